#include "sim/devices/sim_laser.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include "drivers/driver_error.h"

namespace hilbrush {

namespace {

/// Programs keep power and pulse in single precision.
bool is_within(double value, double min, double max) {
  constexpr double kRounding = 1e-6;
  return value >= min * (1 - kRounding) && value <= max * (1 + kRounding);
}

}  // namespace

SimLaser::SimLaser(const CellDescription& cell, double start_delay_s, std::mutex& mutex, SimClock& clock,
                   AxesProbe probe)
    : limits_{cell.laser.power_min_w, cell.laser.power_max_w, cell.laser.pulse_min_s, cell.laser.pulse_max_s},
      tick_s_(cell.timing.tick_s),
      start_delay_s_(start_delay_s),
      mutex_(mutex),
      clock_(clock),
      probe_(std::move(probe)) {}

SimLaser::~SimLaser() {
  const std::lock_guard lock(mutex_);
  cut(clock_.now_s());
}

void SimLaser::connect() {
  const std::lock_guard lock(mutex_);
  if (state_ != DeviceState::kDisconnected) refuse("connected");
  state_ = DeviceState::kConnected;
}

void SimLaser::enable() {
  std::unique_lock lock(mutex_);
  if (state_ != DeviceState::kConnected) refuse("enabled");
  if (!is_interlock_closed_) throw DriverError("the laser cannot be enabled: its interlock is open");
  state_ = DeviceState::kEnabled;
  const auto wall_delay = std::chrono::duration<double>(clock_.wall_s(start_delay_s_));
  state_changed_.wait_for(lock, wall_delay, [this] { return state_ != DeviceState::kEnabled; });
  if (state_ != DeviceState::kEnabled)
    throw DriverError("the laser was turned off again during its start delay");
  clock_.jump_to(clock_.now_s() + start_delay_s_);
  state_ = DeviceState::kReady;
}

void SimLaser::disable() noexcept {
  off();
  const std::lock_guard lock(mutex_);
  cut(clock_.now_s());
  if (state_ == DeviceState::kEnabled || state_ == DeviceState::kReady) state_ = DeviceState::kConnected;
  state_changed_.notify_all();
}

void SimLaser::fire(double power_w, double pulse_s) {
  const std::lock_guard lock(mutex_);
  const double now = clock_.now_s();
  record_ended(now);
  if (state_ != DeviceState::kReady) refuse("fired");
  if (is_emitting(now)) throw DriverError("the laser cannot be fired: it is still emitting");
  if (!is_within(power_w, limits_.power_min_w, limits_.power_max_w) ||
      !is_within(pulse_s, limits_.pulse_min_s, limits_.pulse_max_s)) {
    const std::string text = fmt::format(
        "the laser refuses a pulse of {:.4g} W and {:.4g} ms: its limits are {:.4g} to {:.4g} W and {:.4g} "
        "to {:.4g} "
        "ms",
        power_w, pulse_s * 1e3, limits_.power_min_w, limits_.power_max_w, limits_.pulse_min_s * 1e3,
        limits_.pulse_max_s * 1e3);
    throw DriverError(text);
  }
  const AxesState axes = probe_(now);
  pulse_ = {{.joints = axes.joints,
             .start_s = now,
             .length_s = pulse_s,
             .commanded_s = pulse_s,
             .power_w = power_w,
             .is_moving = !axes.is_settled},
            now + pulse_s};
}

bool SimLaser::off() noexcept {
  double gate_s = 0;
  {
    const std::lock_guard lock(mutex_);
    const double now = clock_.now_s();
    if (!is_emitting(now)) {
      record_ended(now);
      return true;
    }
    gate_s = tick_s_ > 0 ? std::min(pulse_->end_s, (std::floor(now / tick_s_) + 1) * tick_s_) : now;
    pulse_->end_s = gate_s;
  }
  // Not the clock's sleep: that one belongs to the executor's thread.
  clock_.jump_to(gate_s);
  while (clock_.now_s() < gate_s)
    std::this_thread::sleep_for(std::chrono::duration<double>(clock_.wall_s(gate_s - clock_.now_s())));
  const std::lock_guard lock(mutex_);
  record_ended(clock_.now_s());
  return true;
}

Laser::Status SimLaser::status() {
  const std::lock_guard lock(mutex_);
  const double now = clock_.now_s();
  record_ended(now);
  const bool emits = is_emitting(now);
  return {emits ? DeviceState::kMoving : state_, emits, is_interlock_closed_, fault_};
}

void SimLaser::clear_fault() {
  const std::lock_guard lock(mutex_);
  if (state_ != DeviceState::kFault) refuse("cleared of a fault");
  if (!is_interlock_closed_) throw DriverError("the laser's fault cannot be cleared: its interlock is open");
  fault_.clear();
  state_ = DeviceState::kConnected;
}

void SimLaser::set_sink(EmissionSink sink) {
  const std::lock_guard lock(mutex_);
  record_ended(clock_.now_s());
  sink_ = std::move(sink);
}

void SimLaser::set_interlock_closed(bool closed) {
  const std::lock_guard lock(mutex_);
  is_interlock_closed_ = closed;
  if (closed) return;
  cut(clock_.now_s());
  if (state_ == DeviceState::kEnabled || state_ == DeviceState::kReady) fail("the interlock was opened");
}

void SimLaser::note_motion(double now_s) noexcept {
  if (is_emitting(now_s)) pulse_->emission.is_moving = true;
  record_ended(now_s);
}

void SimLaser::cut(double end_s) noexcept {
  if (pulse_) pulse_->end_s = std::min(pulse_->end_s, end_s);
  record_ended(end_s);
}

void SimLaser::record_ended(double now_s) noexcept {
  if (!pulse_ || now_s < pulse_->end_s) return;
  Emission emission = pulse_->emission;
  // What was not cut is exactly what was commanded; the difference of two times would add their rounding.
  if (pulse_->end_s < emission.start_s + emission.commanded_s)
    emission.length_s = pulse_->end_s - emission.start_s;
  pulse_.reset();
  if (!sink_) return;
  try {
    sink_(emission);
  } catch (const std::exception& error) {
    fail(std::string("an emission could not be recorded: ") + error.what());
  }
}

void SimLaser::fail(const std::string& fault) noexcept {
  state_ = DeviceState::kFault;
  fault_ = fault;
  state_changed_.notify_all();
}

void SimLaser::refuse(const char* participle) const {
  const std::string is = state_ == DeviceState::kFault ? "it reports a fault: " + fault_
                                                       : std::string("it is ") + device_state_name(state_);
  throw DriverError(std::string("the laser cannot be ") + participle + ": " + is);
}

}  // namespace hilbrush
