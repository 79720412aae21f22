#pragma once
#include <algorithm>
#include <cmath>
#include <functional>
#include <mutex>
#include <numbers>
#include <string>

#include "drivers/axis_group.h"
#include "drivers/axis_group_state.h"
#include "drivers/driver_error.h"
#include "planner/cell_model/cell_description.h"
#include "sim/devices/axis_motion.h"
#include "sim/devices/sim_clock.h"

namespace hilbrush {

/// N simulated axes that start together, each on its own profile; the group arrives with the slowest, on a
/// control tick. The encoders are absolute: home() makes the group ready without moving, and it begins its
/// life at the axes' home positions.
///
/// Two truths about rest are kept apart: `in_position` of the status is what the controller reports, after
/// the settle time that move_to() was given; is_settled() is what the mechanics did, by the cell's own settle
/// times. They differ if the settle time asked for was too short: a pulse is then recorded as fired while the
/// axes moved.
template <std::size_t N>
class SimAxisGroup final : public AxisGroup<N> {
 public:
  using Positions = typename AxisGroup<N>::Positions;
  using Status = typename AxisGroup<N>::Status;

  /// Called, under the lock, before anything begins to move.
  using MotionListener = std::function<void(double now_s)>;

  /// `mutex` guards the whole simulated cell. `first_axis` is this group's first among the cell's six.
  SimAxisGroup(std::string name, const CellDescription& cell, std::size_t first_axis, std::mutex& mutex,
               SimClock& clock, MotionListener listener)
      : timing_(cell.timing),
        mutex_(mutex),
        clock_(clock),
        on_motion_(std::move(listener)),
        group_(mutex, std::move(name), bounds_of(cell, first_axis), labels_of(first_axis)) {
    group_.is_target_current = true;  // at home
    for (std::size_t i = 0; i < N; ++i) {
      axes_[i] = cell.axes[first_axis + i];
      motions_[i] = AxisMotion(axes_[i].home);
    }
  }

  void connect() override { advance(DeviceState::kDisconnected, DeviceState::kConnected, "connected"); }
  void enable() override { advance(DeviceState::kConnected, DeviceState::kEnabled, "enabled"); }
  void home() override { advance(DeviceState::kEnabled, DeviceState::kReady, "homed"); }
  void clear_fault() override {
    advance(DeviceState::kFault, DeviceState::kConnected, "cleared of a fault");
    const std::lock_guard lock(mutex_);
    group_.fault.clear();
  }

  void disable() noexcept override {
    const std::lock_guard lock(mutex_);
    if (group_.state == DeviceState::kDisconnected) return;
    brake(clock_.now_s());
    if (group_.state != DeviceState::kFault) group_.state = DeviceState::kConnected;
  }

  void move_to(const Positions& target, double settle_s) override {
    const std::lock_guard lock(mutex_);
    const double now = update();
    if (group_.shown_state() != DeviceState::kReady) group_.refuse("moved");
    group_.check_settle_time(settle_s);
    group_.check_bounds(target);

    on_motion_(now);
    double end = now;
    double share = 0;
    for (std::size_t i = 0; i < N; ++i) {
      const double move = std::abs(target[i] - motions_[i].position(now));
      if (axes_[i].settle_saturation > 0)
        share = std::max(share, std::min(1., move / axes_[i].settle_saturation));
      motions_[i] = motions_[i].move_to(target[i], now, axes_[i].speed_max, axes_[i].acceleration_max);
      end = std::max(end, motions_[i].end_s());
    }
    rest_s_ = end;
    settled_s_ = end + timing_.settle_min_s + (timing_.settle_max_s - timing_.settle_min_s) * share;
    group_.arrival_s = now + whole_ticks(end - now) + settle_s;
    group_.is_target_current = true;
  }

  Status status() override {
    const std::lock_guard lock(mutex_);
    const double now = update();
    return group_.status(positions_at(now), 0);
  }

  double expected_arrival_s() override {
    const std::lock_guard lock(mutex_);
    const double now = update();
    return group_.expected_arrival_s(now);
  }

  void stop() noexcept override {
    const std::lock_guard lock(mutex_);
    brake(clock_.now_s());
  }

  /// Breaks the device: it brakes and reports `fault` until clear_fault(). From any thread.
  void fail(const std::string& fault) {
    const std::lock_guard lock(mutex_);
    brake(clock_.now_s());
    group_.state = DeviceState::kFault;
    group_.fault = fault;
  }

  /// The caller holds the cell's mutex.
  Positions positions_at(double now_s) const {
    Positions positions;
    for (std::size_t i = 0; i < N; ++i) positions[i] = motions_[i].position(now_s);
    return positions;
  }
  /// Whether the mechanics are at rest and have rung down. The caller holds the cell's mutex.
  bool is_settled(double now_s) const {
    constexpr double kRoundingS = 1e-9;
    return now_s >= settled_s_ - kRoundingS;
  }

 private:
  static std::array<AxisBounds, N> bounds_of(const CellDescription& cell, std::size_t first_axis) {
    std::array<AxisBounds, N> bounds;
    for (std::size_t i = 0; i < N; ++i) {
      const AxisDescription& axis = cell.axes[first_axis + i];
      bounds[i] = {axis.min, axis.max, axis.speed_max, axis.acceleration_max};
    }
    return bounds;
  }
  static std::array<AxisLabel, N> labels_of(std::size_t first_axis) {
    std::array<AxisLabel, N> labels;
    for (std::size_t i = 0; i < N; ++i) {
      const std::size_t axis = first_axis + i;
      labels[i] = axis == kJ3 ? AxisLabel{kAxisNames[axis], 1e3, "mm"}
                              : AxisLabel{kAxisNames[axis], 180 / std::numbers::pi, "degrees"};
    }
    return labels;
  }

  /// The present time; whether the group has arrived changes with it.
  double update() {
    const double now = clock_.now_s();
    group_.is_in_position = group_.is_target_current && now >= group_.arrival_s;
    return now;
  }

  void advance(DeviceState from, DeviceState to, const char* participle) {
    const std::lock_guard lock(mutex_);
    update();
    if (group_.state != from) group_.refuse(participle);
    group_.state = to;
  }

  double whole_ticks(double duration_s) const {
    if (timing_.tick_s <= 0) return duration_s;
    constexpr double kRoundingTicks = 1e-6;
    return std::ceil(duration_s / timing_.tick_s - kRoundingTicks) * timing_.tick_s;
  }

  void brake(double now) {
    if (now >= rest_s_) {
      if (now < group_.arrival_s) group_.is_target_current = false;
      return;
    }
    const double ring_s = settled_s_ - rest_s_;
    rest_s_ = now;
    for (std::size_t i = 0; i < N; ++i) {
      motions_[i] = motions_[i].brake(now, axes_[i].acceleration_max);
      rest_s_ = std::max(rest_s_, motions_[i].end_s());
    }
    settled_s_ = rest_s_ + ring_s;
    group_.is_target_current = false;
  }

  const CellDescription::Timing timing_;
  std::mutex& mutex_;
  SimClock& clock_;
  const MotionListener on_motion_;

  std::array<AxisDescription, N> axes_;
  std::array<AxisMotion, N> motions_;
  AxisGroupState<N> group_;  ///< its arrival_s is exact: when the controller reports in position
  double rest_s_ = 0;        ///< when the last axis comes to rest
  double settled_s_ = 0;     ///< when the mechanics have rung down
};

}  // namespace hilbrush
