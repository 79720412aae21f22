#include "sim/wire/true_cell.h"

#include <algorithm>
#include <cmath>

#include "sim/wire/time_record.h"

namespace hilbrush {

TrueCell::TrueCell(const CellDescription& description, const TrueCellOptions& options)
    : description_(description), options_(options), power_max_w_(description.laser.power_max_w) {
  for (std::size_t i = 0; i < kAxisCount; ++i) displace_axis(i, limits(i).home);
}

void TrueCell::advance(double now_s) {
  if (now_s <= now_s_) return;
  const double begins_s = std::max(may_emit_s_, options_.warm_up_s);
  if (is_ordered_ && begins_s > now_s_ && begins_s <= now_s) {
    now_s_ = begins_s;
    update_light();
  }
  now_s_ = now_s;
  for (Axis& axis : axes_) note_off(axis);
}

double TrueCell::next_event_s() const {
  double next = kNever;
  const auto consider = [&](double time_s) {
    if (time_s > now_s_) next = std::min(next, time_s);
  };
  for (const Axis& axis : axes_) {
    consider(axis.rest_s);
    consider(axis.settled_s);
  }
  if (is_ordered_) consider(std::max(may_emit_s_, options_.warm_up_s));
  return next;
}

void TrueCell::move_axis(std::size_t axis, double target, double speed_scale) {
  const AxisDescription& description = limits(axis);
  move_axis(axis, target, description.speed_max * speed_scale, description.acceleration_max * speed_scale);
}

void TrueCell::move_axis(std::size_t index, double target, double speed_max, double acceleration) {
  const AxisDescription& description = limits(index);
  Axis& axis = axes_[index];
  const double distance = std::abs(target - axis.motion.position(now_s_) - drift(axis));
  axis.target = target;
  if (axis.is_jammed) return;
  if (distance == 0 && now_s_ >= axis.motion.end_s()) return;
  const double share =
      description.settle_saturation > 0 ? std::min(1., distance / description.settle_saturation) : 1;
  begin_motion(index, target, std::min(speed_max, description.speed_max),
               std::min(acceleration, description.acceleration_max), share);
}

void TrueCell::move_chain(Chain chain, std::span<const double> target, double speed_scale) {
  const auto& motion = description_.motion;
  const Interpolation interpolation = chain.first == kRobotChain.first ? motion.robot : motion.table;
  if (interpolation != Interpolation::kCoordinated) {
    for (std::size_t i = 0; i < chain.count; ++i) move_axis(chain.first + i, target[i], speed_scale);
    return;
  }
  // The whole move is 1 long; of it every axis allows a speed and an acceleration.
  double speed = kNever;
  double acceleration = kNever;
  const auto distance_of = [&](std::size_t i) {
    const Axis& axis = axes_[chain.first + i];
    return std::abs(target[i] - axis.motion.position(now_s_) - drift(axis));
  };
  for (std::size_t i = 0; i < chain.count; ++i) {
    if (distance_of(i) == 0) continue;
    speed = std::min(speed, limits(chain.first + i).speed_max * speed_scale / distance_of(i));
    acceleration =
        std::min(acceleration, limits(chain.first + i).acceleration_max * speed_scale / distance_of(i));
  }
  for (std::size_t i = 0; i < chain.count; ++i) {
    if (distance_of(i) == 0)
      move_axis(chain.first + i, target[i], speed_scale);
    else
      move_axis(chain.first + i, target[i], speed * distance_of(i), acceleration * distance_of(i));
  }
}

void TrueCell::begin_motion(std::size_t index, double target, double speed_max, double acceleration,
                            double share) {
  Axis& axis = axes_[index];
  // Light that is on while something begins to move is a fault, whichever was ordered first.
  if (emission_) emission_->is_moving = true;
  if (times_) times_->note_motion(index < kTilt ? WireDevice::kRobot : WireDevice::kTable, now_s_);
  // An order takes up what had drifted: the controller closes its loop again.
  const double from = axis.motion.position(now_s_) + drift(axis);
  if (axis.drifted != 0 || axis.drift_speed != 0) {
    axis.motion = AxisMotion(from);
    axis.drifted = axis.drift_speed = 0;
  }
  axis.motion = axis.motion.move_to(target, now_s_, speed_max, acceleration);
  axis.rest_s = axis.motion.end_s();
  const auto& timing = description_.timing;
  const double ring_s = timing.settle_min_s + (timing.settle_max_s - timing.settle_min_s) * share;
  axis.settled_s = std::max(axis.settled_s, axis.rest_s + ring_s);
  axis.creep = std::copysign(kCreep * share * (index == kJ3 ? .1 : 1), from - target);
  axis.off_since_s = kNever;
}

void TrueCell::brake_axis(std::size_t index) {
  Axis& axis = axes_[index];
  if (axis.is_jammed || now_s_ >= axis.rest_s) {
    axis.target = axis.motion.target();
    return;
  }
  const double ring_s = axis.settled_s - axis.rest_s;
  axis.motion = axis.motion.brake(now_s_, limits(index).acceleration_max);
  axis.target = axis.motion.target();
  axis.rest_s = std::max(now_s_, axis.motion.end_s());
  axis.settled_s = axis.rest_s + ring_s;
}

double TrueCell::drift(const Axis& axis) const {
  return axis.drifted + axis.drift_speed * (now_s_ - axis.drift_from_s);
}

double TrueCell::position(std::size_t index) const {
  const Axis& axis = axes_[index];
  double creep = 0;
  if (now_s_ >= axis.rest_s && now_s_ < axis.settled_s) {
    constexpr double kDecay = 9;  // to a ten-thousandth at the end
    creep = axis.creep * std::exp(-kDecay * (now_s_ - axis.rest_s) / (axis.settled_s - axis.rest_s));
  }
  return axis.motion.position(now_s_) + creep + drift(axis);
}

double TrueCell::profile(std::size_t index) const {
  return axes_[index].motion.position(now_s_);
}

double TrueCell::speed(std::size_t index) const {
  const Axis& axis = axes_[index];
  return axis.motion.speed(now_s_) + axis.drift_speed;
}

bool TrueCell::is_moving(std::size_t index) const {
  const Axis& axis = axes_[index];
  return now_s_ < axis.rest_s || (axis.is_jammed && axis.target != axis.motion.target());
}

bool TrueCell::is_settled(std::size_t index) const {
  constexpr double kRoundingS = 1e-9;
  const Axis& axis = axes_[index];
  return !is_moving(index) && now_s_ >= axis.settled_s - kRoundingS &&
         now_s_ < axis.off_since_s + options_.notice_s;
}

bool TrueCell::is_settled() const {
  for (std::size_t i = 0; i < kAxisCount; ++i)
    if (!is_settled(i)) return false;
  return true;
}

Joints TrueCell::joints() const {
  Joints joints;
  for (std::size_t i = 0; i < kAxisCount; ++i) joints[i] = position(i);
  return joints;
}

CellPhase TrueCell::phase() const {
  if (is_emitting()) return CellPhase::kPulse;
  for (std::size_t i = 0; i < kAxisCount; ++i)
    if (is_moving(i)) return CellPhase::kMoving;
  return is_settled() ? CellPhase::kSettled : CellPhase::kSettling;
}

void TrueCell::jam_axis(std::size_t index) {
  Axis& axis = axes_[index];
  const double here = axis.motion.position(now_s_);
  if (now_s_ < axis.rest_s) {
    axis.motion = AxisMotion(here);
    axis.rest_s = axis.settled_s = now_s_;
    axis.creep = 0;
  }
  axis.is_jammed = true;
}

void TrueCell::free_axis(std::size_t index) {
  Axis& axis = axes_[index];
  axis.is_jammed = false;
  axis.target = axis.motion.target();
}

void TrueCell::drift_axis(std::size_t index, double speed) {
  Axis& axis = axes_[index];
  axis.drifted = drift(axis);
  axis.drift_from_s = now_s_;
  axis.drift_speed = speed;
}

void TrueCell::displace_axis(std::size_t index, double position) {
  Axis axis;
  axis.motion = AxisMotion(position);
  axis.target = position;
  axes_[index] = axis;
}

void TrueCell::note_off(Axis& axis) {
  const double away = std::abs(drift(axis));
  if (away <= kOutOfPosition)
    axis.off_since_s = kNever;
  else if (axis.off_since_s == kNever)
    axis.off_since_s = now_s_;
}

void TrueCell::set_key(bool is_on) {
  has_key_ = is_on;
  if (!is_on && is_ordered_) is_tripped_ = true;
  if (!is_on) is_ordered_ = false;
  update_light();
}

void TrueCell::set_interlock(bool is_closed) {
  is_interlock_closed_ = is_closed;
  if (!is_closed && is_ordered_) is_tripped_ = true;
  if (!is_closed) is_ordered_ = false;
  update_light();
}

bool TrueCell::set_emission(bool is_on) {
  if (is_on && (!has_key_ || !is_interlock_closed_)) return false;
  if (is_on && !is_ordered_) may_emit_s_ = now_s_ + options_.start_delay_s;
  is_ordered_ = is_on;
  is_tripped_ = false;
  update_light();
  return true;
}

void TrueCell::set_modulation(Modulation modulation) {
  modulation_ = modulation;
  update_light();
}

void TrueCell::set_power(double power_w) {
  // Light of another power is another emission.
  if (emission_ && power_w != power_w_) end_light();
  power_w_ = power_w;
  update_light();
}

void TrueCell::set_gate(bool is_open, std::optional<double> pulse_s) {
  is_gate_open_ = is_open;
  update_light();
  if (emission_ && is_open && pulse_s) emission_->commanded_s = now_s_ - emission_->start_s + *pulse_s;
}

void TrueCell::set_serial_gate(bool is_open) {
  is_serial_gate_open_ = is_open;
  update_light();
}

void TrueCell::set_power_max(double power_w) {
  power_max_w_ = power_w;
  if (power_w_ > power_w) set_power(power_w);
}

bool TrueCell::may_emit() const {
  if (!is_ordered_ || !has_key_ || !is_interlock_closed_ || now_s_ < may_emit_s_ || is_warming_up())
    return false;
  return modulation_ == Modulation::kNone ||
         (modulation_ == Modulation::kWired ? is_gate_open_ : is_serial_gate_open_);
}

void TrueCell::update_light() {
  if (!may_emit()) {
    end_light();
    return;
  }
  if (emission_) return;
  emission_ =
      Emission{.joints = joints(), .start_s = now_s_, .power_w = power_w_, .is_moving = !is_settled()};
  if (times_) times_->note_light(true, now_s_);
  // Unbounded light has no commanded length: the longest pulse the cell allows stands for it.
  emission_->commanded_s = description_.laser.pulse_max_s;
}

void TrueCell::end_light() {
  if (!emission_) return;
  Emission ended = *emission_;
  emission_.reset();
  ended.length_s = now_s_ - ended.start_s;
  // What was not cut is exactly what was commanded; the difference of two times would add their rounding.
  if (std::abs(ended.length_s - ended.commanded_s) < 1e-9) ended.length_s = ended.commanded_s;
  if (times_) times_->note_light(false, now_s_);
  if (sink_) sink_(ended);
}

void TrueCell::disarm() {
  is_ordered_ = false;
  end_light();
}

}  // namespace hilbrush
