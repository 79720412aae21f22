#pragma once
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <mutex>
#include <numbers>
#include <string>

#include "drivers/axis_group.h"
#include "drivers/driver_error.h"
#include "planner/cell_model/cell_description.h"
#include "sim/devices/axis_motion.h"
#include "sim/devices/sim_clock.h"

namespace hilbrush {

/// N simulated axes that start together, each on its own profile; the group arrives with the slowest, on a control
/// tick. The encoders are absolute: home() makes the group ready without moving, and it begins its life at the axes'
/// home positions.
///
/// Two truths about rest are kept apart: `in_position` of the status is what the controller reports, after the settle
/// time that move_to() was told; is_settled() is what the mechanics did, by the cell's own settle figures. A caller who
/// asks for too short a settle time can see the first and is betrayed by the second.
template <std::size_t N>
class SimAxisGroup final : public AxisGroup<N> {
 public:
  using Positions = typename AxisGroup<N>::Positions;
  using Status = typename AxisGroup<N>::Status;

  /// Told, under the lock, before anything begins to move.
  using MotionListener = std::function<void(double now_s)>;

  /// `mutex` guards the whole simulated cell. `first_axis` is this group's first among the cell's six.
  SimAxisGroup(std::string name, const CellDescription& cell, int first_axis, std::mutex& mutex, SimClock& clock,
               MotionListener listener)
      : name_(std::move(name)),
        timing_(cell.timing),
        first_axis_(first_axis),
        mutex_(mutex),
        clock_(clock),
        on_motion_(std::move(listener)) {
    for (std::size_t i = 0; i < N; ++i) {
      axes_[i] = cell.axes[first_axis + i];
      motions_[i] = AxisMotion(axes_[i].home);
      target_[i] = axes_[i].home;
    }
  }

  void connect() override { advance(DeviceState::kDisconnected, DeviceState::kConnected, "connected"); }
  void enable() override { advance(DeviceState::kConnected, DeviceState::kEnabled, "enabled"); }
  void home() override { advance(DeviceState::kEnabled, DeviceState::kReady, "homed"); }
  void clear_fault() override {
    advance(DeviceState::kFault, DeviceState::kConnected, "cleared of a fault");
    const std::lock_guard lock(mutex_);
    fault_.clear();
  }

  void disable() noexcept override {
    const std::lock_guard lock(mutex_);
    if (state_ == DeviceState::kDisconnected) return;
    brake(clock_.now_s());
    if (state_ != DeviceState::kFault) state_ = DeviceState::kConnected;
  }

  void move_to(const Positions& target, double settle_s) override {
    const std::lock_guard lock(mutex_);
    const double now = clock_.now_s();
    if (state_now(now) != DeviceState::kReady) refuse("moved", now);
    if (!(settle_s >= 0) || settle_s > kMaxSettleS)
      throw DriverError("the " + name_ + " refuses a settle time that is no time");
    for (std::size_t i = 0; i < N; ++i) check_limits(i, target[i]);

    on_motion_(now);
    double end = now, share = 0;
    for (std::size_t i = 0; i < N; ++i) {
      const double move = std::abs(target[i] - motions_[i].position(now));
      if (axes_[i].settle_saturation > 0) share = std::max(share, std::min(1., move / axes_[i].settle_saturation));
      motions_[i] = motions_[i].move_to(target[i], now, axes_[i].speed_max, axes_[i].acceleration_max);
      end = std::max(end, motions_[i].end_s());
    }
    target_ = target;
    rest_s_ = end;
    settled_s_ = end + timing_.settle_min_s + (timing_.settle_max_s - timing_.settle_min_s) * share;
    in_position_s_ = now + whole_ticks(end - now) + settle_s;
    is_target_current_ = true;
  }

  Status status() override {
    const std::lock_guard lock(mutex_);
    const double now = clock_.now_s();
    const bool in_position = state_ == DeviceState::kReady && is_target_current_ && now >= in_position_s_;
    return {state_now(now), positions_at(now), in_position, fault_};
  }

  double expected_arrival_s() override {
    const std::lock_guard lock(mutex_);
    const double now = clock_.now_s();
    return is_target_current_ ? std::max(now, in_position_s_) : now;
  }

  void stop() noexcept override {
    const std::lock_guard lock(mutex_);
    brake(clock_.now_s());
  }

  /// Breaks the device: it brakes and reports `fault` until clear_fault(). From any thread.
  void fail(const std::string& fault) {
    const std::lock_guard lock(mutex_);
    brake(clock_.now_s());
    state_ = DeviceState::kFault;
    fault_ = fault;
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
  static constexpr double kMaxSettleS = 60;

  /// kReady turns to kMoving and back by itself, with time.
  DeviceState state_now(double now) const {
    const bool is_under_way = is_target_current_ && now < in_position_s_;
    return state_ == DeviceState::kReady && is_under_way ? DeviceState::kMoving : state_;
  }

  void advance(DeviceState from, DeviceState to, const char* participle) {
    const std::lock_guard lock(mutex_);
    if (state_ != from) refuse(participle, clock_.now_s());
    state_ = to;
  }

  [[noreturn]] void refuse(const char* participle, double now) const {
    const DeviceState state = state_now(now);
    const std::string is = state == DeviceState::kFault ? "it reports a fault: " + fault_
                                                        : std::string("it is ") + device_state_name(state);
    throw DriverError("the " + name_ + " cannot be " + participle + ": " + is);
  }

  void check_limits(std::size_t i, double target) const {
    constexpr double kRounding = 1e-9;
    const AxisDescription& axis = axes_[i];
    if (target >= axis.min - kRounding && target <= axis.max + kRounding) return;
    const int index = first_axis_ + static_cast<int>(i);
    const double unit = index == kJ3 ? 1e-3 : std::numbers::pi / 180;
    char text[160];
    std::snprintf(text, sizeof text, "the %s refuses %s = %.3f %s: its limits are %.3f and %.3f", name_.c_str(),
                  kAxisNames[index], target / unit, index == kJ3 ? "mm" : "degrees", axis.min / unit, axis.max / unit);
    throw DriverError(text);
  }

  double whole_ticks(double duration_s) const {
    if (timing_.tick_s <= 0) return duration_s;
    constexpr double kRoundingTicks = 1e-6;
    return std::ceil(duration_s / timing_.tick_s - kRoundingTicks) * timing_.tick_s;
  }

  void brake(double now) {
    if (now >= rest_s_) {
      if (now < in_position_s_) is_target_current_ = false;
      return;
    }
    const double ring_s = settled_s_ - rest_s_;
    rest_s_ = now;
    for (std::size_t i = 0; i < N; ++i) {
      motions_[i] = motions_[i].brake(now, axes_[i].acceleration_max);
      rest_s_ = std::max(rest_s_, motions_[i].end_s());
    }
    settled_s_ = rest_s_ + ring_s;
    is_target_current_ = false;
  }

  const std::string name_;
  const CellDescription::Timing timing_;
  const int first_axis_;
  std::mutex& mutex_;
  SimClock& clock_;
  const MotionListener on_motion_;

  std::array<AxisDescription, N> axes_;
  std::array<AxisMotion, N> motions_;
  DeviceState state_ = DeviceState::kDisconnected;
  std::string fault_;
  Positions target_{};
  bool is_target_current_ = true;  ///< false after a stop on the way
  double rest_s_ = 0;              ///< when the last axis comes to rest
  double settled_s_ = 0;           ///< when the mechanics have rung down
  double in_position_s_ = 0;       ///< when the controller reports in position
};

}  // namespace hilbrush
