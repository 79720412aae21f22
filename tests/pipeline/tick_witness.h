#pragma once
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "planner/cell_model/cell_description.h"
#include "sim/devices/sim_cell.h"

/// Looks at the simulated cell's true joints on every control tick while the executor sleeps: positions,
/// speeds and accelerations against the cell's limits, and whatever the test asks besides.
namespace hilbrush::testing_pipeline {

class TickWitness final : public Clock {
 public:
  using Look = std::function<std::string(const Joints&)>;

  /// `look` (optional) names a fault of a pose, or returns an empty text.
  TickWitness(SimCell& sim, const CellDescription& description, Look look = {})
      : sim_(sim), clock_(sim.cell().clock), description_(description), look_(std::move(look)) {}

  /// The cell as the executor is to use it.
  Cell cell() {
    const Cell inner = sim_.cell();
    return {inner.robot, inner.table, inner.laser, *this};
  }

  double now_s() const override { return clock_.now_s(); }
  void sleep_until(double time_s) override {
    const double tick_s = description_.timing.tick_s;
    if (time_s > now_s() + tick_s) {
      at_.reset();
      before_.reset();
    }
    while (now_s() + tick_s < time_s) {
      inspect();
      clock_.sleep_until(now_s() + tick_s);
    }
    inspect();
    clock_.sleep_until(time_s);
  }
  void wake() override { clock_.wake(); }
  double wall_s(double cell_s) const override { return clock_.wall_s(cell_s); }

  const std::string& first_fault() const { return fault_; }
  std::size_t ticks() const { return ticks_; }

 private:
  void inspect() {
    const Joints now = sim_.joints();
    ++ticks_;
    for (std::size_t i = 0; i < kAxisCount && fault_.empty(); ++i) {
      const AxisDescription& axis = description_.axes[i];
      const double tick_s = description_.timing.tick_s;
      if (!(now[i] >= axis.min - 1e-9 && now[i] <= axis.max + 1e-9)) blame(i, "is outside its limits");
      if (at_ && !(std::abs(now[i] - (*at_)[i]) <= axis.speed_max * tick_s * (1 + 1e-6) + 1e-9))
        blame(i, "is faster than its limit");
      if (at_ && before_ &&
          !(std::abs(now[i] - 2 * (*at_)[i] + (*before_)[i]) <=
            axis.acceleration_max * tick_s * tick_s * (1 + 1e-6) + 1e-9))
        blame(i, "accelerates more than its limit");
    }
    if (look_ && fault_.empty()) fault_ = look_(now);
    before_ = std::exchange(at_, now);
  }
  void blame(std::size_t axis, const char* what) {
    fault_ = std::string(kAxisNames[axis]) + " " + what + " at " + std::to_string(now_s()) + " s";
  }

  SimCell& sim_;
  Clock& clock_;
  const CellDescription& description_;
  Look look_;
  std::optional<Joints> at_, before_;  ///< one and two ticks ago
  std::string fault_;
  std::size_t ticks_ = 0;
};

}  // namespace hilbrush::testing_pipeline
