#include "drivers/laser/gated_laser.h"

#include <algorithm>
#include <cmath>

#include "drivers/driver_error.h"
#include "drivers/number_text.h"

namespace hilbrush {
namespace {

constexpr double kRounding = 1e-6;  ///< programs keep power and pulse in single precision

bool is_within(double value, double min, double max) {
  return value >= min * (1 - kRounding) && value <= max * (1 + kRounding);
}

std::string milli_text(double value) {
  return number_text(value * 1e3, 4);
}

/// "0.5 to 100"
std::string range_text(double min, double max) {
  return milli_text(min) + " to " + milli_text(max);
}

}  // namespace

GatedLaser::GatedLaser(std::unique_ptr<LaserHead> head, Gate& gate, const Limits& limits, Clock& clock)
    : head_(std::move(head)), gate_(gate), limits_(limits), clock_(clock) {
  // If the gate cannot be closed, only disarming the head turns the light off.
  gate_.set_listener([this](bool is_dark) {
    if (is_dark)
      note_dark();
    else
      head_->disarm();
  });
  head_->set_listener([this] { note_reading(); });
}

GatedLaser::~GatedLaser() {
  disable();
  gate_.set_listener({});
}

void GatedLaser::connect() {
  if (!gate_.off())
    throw DriverError("the laser cannot be connected: its gate does not confirm that it is off");
  head_->connect();
}

void GatedLaser::check_powers() {
  const LaserHead::Powers powers = head_->powers();
  if (is_within(limits_.power_min_w, powers.min_w, powers.max_w) &&
      is_within(limits_.power_max_w, powers.min_w, powers.max_w))
    return;
  throw DriverError("the cell file gives the laser " + range_text(limits_.power_min_w, limits_.power_max_w) +
                    " mW, but its own limits are " + range_text(powers.min_w, powers.max_w) + " mW");
}

void GatedLaser::enable() {
  if (!gate_.off())
    throw DriverError("the laser cannot be enabled: its gate does not confirm that it is off");
  check_powers();
  head_->arm();
  may_fire_ = true;
}

void GatedLaser::disable() noexcept {
  may_fire_ = false;
  gate_.off();
  head_->disarm();
}

void GatedLaser::check_ready() {
  const Status now = status();
  if (now.state != DeviceState::kReady)
    throw DriverError(std::string("the laser cannot be fired: it is ") + device_state_name(now.state) +
                      (now.fault.empty() ? "" : ": " + now.fault));
  if (!now.interlock_closed) throw DriverError("the laser cannot be fired: its interlock is open");
}

/// A gate that counts in whole steps gets the next longer one, at the power that keeps the energy.
GatedLaser::Timed GatedLaser::timed(double power_w, double pulse_s) const {
  if (!is_within(power_w, limits_.power_min_w, limits_.power_max_w) ||
      !is_within(pulse_s, limits_.pulse_min_s, limits_.pulse_max_s))
    throw DriverError("the laser refuses a pulse of " + milli_text(power_w) + " mW and " +
                      milli_text(pulse_s) + " ms: its limits are " +
                      range_text(limits_.power_min_w, limits_.power_max_w) + " mW and " +
                      range_text(limits_.pulse_min_s, limits_.pulse_max_s) + " ms");
  const double step_s = gate_.resolution_s();
  const double timed_s = step_s > 0 ? std::max(1., std::ceil(pulse_s / step_s - 1e-3)) * step_s : pulse_s;
  return {std::max(power_w * pulse_s / timed_s, limits_.power_min_w), timed_s};
}

void GatedLaser::prepare(double power_w, double pulse_s) {
  check_ready();
  head_->set_power(timed(power_w, pulse_s).power_w);
}

void GatedLaser::fire(double power_w, double pulse_s) {
  check_ready();
  const Timed pulse = timed(power_w, pulse_s);
  head_->set_power(pulse.power_w);
  if (!may_fire_) throw DriverError("the laser cannot be fired: it was disabled");
  {
    const std::lock_guard lock(mutex_);
    is_reading_due_ = true;
    gate_dark_s_ = -1;
  }
  try {
    head_->begin_pulse(pulse.pulse_s);
    gate_.pulse(pulse.pulse_s);
  } catch (const DriverError&) {
    // A gate that refused the pulse has none to end, so its listener is not called.
    if (gate_.off()) note_dark();
    throw;
  }
}

/// Any thread.
void GatedLaser::note_dark() {
  {
    const std::lock_guard lock(mutex_);
    if (!is_reading_due_ || gate_dark_s_ >= 0) return;
    gate_dark_s_ = clock_.now_s();
  }
  head_->end_pulse();  // before the next can begin
  head_->request_status();
}

/// Any thread.
void GatedLaser::note_reading() {
  const LaserHead::Status head = head_->status();
  {
    const std::lock_guard lock(mutex_);
    const bool is_failed = head.state == DeviceState::kFault;
    if (is_reading_due_ && gate_dark_s_ >= 0 && (is_failed || head.read_s >= gate_dark_s_)) {
      is_reading_due_ = false;
      dark_since_s_ = gate_dark_s_;
    }
  }
  clock_.wake();
}

bool GatedLaser::off() noexcept {
  return gate_.off();
}

Laser::Status GatedLaser::status() {
  const LaserHead::Status head = head_->status();
  Status status;
  status.is_emitting = gate_.is_on();
  {
    const std::lock_guard lock(mutex_);
    if (is_reading_due_ && head.state == DeviceState::kReady) status.is_emitting = true;
    // The gate's word comes first, the laser's own account of the pulse after it.
    status.dark_since_s = !status.is_emitting ? dark_since_s_
                          : is_reading_due_   ? std::max(0., gate_dark_s_)
                                              : 0;
  }
  status.state = status.is_emitting && head.state == DeviceState::kReady ? DeviceState::kMoving : head.state;
  status.interlock_closed = head.interlock_closed;
  status.fault = head.fault;
  return status;
}

void GatedLaser::clear_fault() {
  may_fire_ = false;
  if (!gate_.off())
    throw DriverError("the laser's fault cannot be cleared: its gate does not confirm that it is off");
  head_->clear_fault();
}

}  // namespace hilbrush
