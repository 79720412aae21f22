#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <mutex>
#include <string>
#include <utility>

#include "drivers/axis_group.h"
#include "drivers/device_options.h"
#include "drivers/driver_error.h"
#include "drivers/number_text.h"

namespace hilbrush {

/// How messages name an axis and write its positions.
struct AxisLabel {
  std::string name;         ///< "j1"
  double units_per_si = 1;  ///< of `unit`, for one rad or m
  std::string unit;         ///< "degrees"
};

/// What all groups of axes keep about themselves, and what they refuse because of it: the place in the life
/// cycle, the fault, the last target and whether the axes are in position there. The group's mutex guards it:
/// unless said otherwise, the caller holds that.
template <std::size_t N>
class AxisGroupState {
 public:
  using Positions = typename AxisGroup<N>::Positions;
  using Status = typename AxisGroup<N>::Status;

  /// `name`: "robot". `bounds`: what targets and speeds the group takes. `mutex` outlives it.
  AxisGroupState(std::mutex& mutex, std::string name, const std::array<AxisBounds, N>& bounds,
                 std::array<AxisLabel, N> labels)
      : mutex_(mutex), name_(std::move(name)), bounds_(bounds), labels_(std::move(labels)) {}

  DeviceState state = DeviceState::kDisconnected;  ///< never kMoving: see shown_state()
  std::string fault;                               ///< a sentence, if state is kFault
  bool is_target_current = false;  ///< false after a stop and a fault: the axes are not bound for it
  bool is_in_position = false;
  double settle_s = 0;   ///< asked for with the target
  double arrival_s = 0;  ///< expected, on the cell's clock
  double in_position_since_s = 0;

  const std::string& name() const { return name_; }
  bool is_under_way() const { return is_target_current && !is_in_position; }
  /// kReady turns into kMoving and back by itself.
  DeviceState shown_state() const {
    return state == DeviceState::kReady && is_under_way() ? DeviceState::kMoving : state;
  }

  Status status(const Positions& positions, double read_s) const {
    Status status;
    status.state = shown_state();
    status.positions = positions;
    status.in_position = state == DeviceState::kReady && is_in_position;
    status.fault = fault;
    status.in_position_since_s = status.in_position ? in_position_since_s : 0;
    status.read_s = read_s;
    return status;
  }
  double expected_arrival_s(double now_s) const {
    return is_under_way() ? std::max(now_s, arrival_s) : now_s;
  }

  /// Forgets the target. True if the fault is new: a group that is disconnected or in fault keeps what it
  /// had.
  bool set_fault(const std::string& sentence) {
    is_in_position = is_target_current = false;
    if (state == DeviceState::kFault || state == DeviceState::kDisconnected) return false;
    state = DeviceState::kFault;
    fault = sentence;
    return true;
  }

  /// @throws DriverError "the robot cannot be moved: it is disconnected"
  [[noreturn]] void refuse(const char* participle) const {
    throw DriverError("the " + name_ + " cannot be " + participle + ": it " +
                      (state == DeviceState::kFault ? "reports a fault: " + fault
                                                    : std::string("is ") + device_state_name(shown_state())));
  }
  /// Takes the lock. @throws DriverError unless the group is in this state.
  void require(DeviceState wanted, const char* participle) const {
    const std::lock_guard lock(mutex_);
    if (state != wanted) refuse(participle);
  }

  // What follows needs no lock.
  void check_settle_time(double wanted_s) const {
    if (wanted_s >= 0 && wanted_s <= kMaxSettleS) return;
    throw DriverError("the " + name_ + " refuses a settle time of " + number_text(wanted_s, 6) +
                      " s: it must be 0 to " + number_text(kMaxSettleS, 6) + " s");
  }
  void check_bounds(const Positions& target) const {
    for (std::size_t i = 0; i < N; ++i) {
      const AxisBounds& bounds = bounds_[i];
      if (target[i] >= bounds.min - kBoundsTolerance && target[i] <= bounds.max + kBoundsTolerance) continue;
      const auto text = [&](double value) { return number_text(value * labels_[i].units_per_si, 7); };
      throw DriverError("the " + name_ + " refuses to move " + labels_[i].name + " to " + text(target[i]) +
                        " " + labels_[i].unit + ": its limits are " + text(bounds.min) + " and " +
                        text(bounds.max));
    }
  }
  /// How long trapezoidal profiles within the bounds take for these distances (rad, m): a hint for those who
  /// wait.
  double travel_s(const std::array<double, N>& distances) const {
    double max_s = 0;
    for (std::size_t i = 0; i < N; ++i) {
      const double path = distances[i];
      const double speed = bounds_[i].speed_max;
      const double rate = bounds_[i].acceleration_max;
      if (!(speed > 0) || !(rate > 0)) continue;
      max_s = std::max(
          max_s, path * rate < speed * speed ? 2 * std::sqrt(path / rate) : path / speed + speed / rate);
    }
    return max_s;
  }

 private:
  std::mutex& mutex_;
  const std::string name_;
  const std::array<AxisBounds, N> bounds_;
  const std::array<AxisLabel, N> labels_;
};

}  // namespace hilbrush
