#include "drivers/dobot/dobot_gate.h"

#include <cmath>
#include <string>

#include "drivers/driver_error.h"

namespace hilbrush {
namespace {

constexpr std::uint64_t kFramesOfGrace = 4;  ///< until a frame must show an output that was confirmed off
constexpr std::uint64_t kOverdueMs = 16;     ///< two frames: how finely a controller may divide its time
constexpr double kFirstTryS = 0.005;         ///< wall: for the first try to end a pulse

}  // namespace

/// Under the robot's mutex.
void DobotRobot::OutputGate::note_off() {
  is_pulsing_ = false;
  is_known_off_ = true;
  known_frame_ = robot_.frame_count_;
}

void DobotRobot::OutputGate::set_listener(Listener listener) {
  const std::lock_guard lock(robot_.mutex_);
  listener_ = std::move(listener);
}

void DobotRobot::OutputGate::notify(bool is_dark) {
  Listener listener;
  {
    const std::lock_guard lock(robot_.mutex_);
    listener = listener_;
  }
  if (listener) listener(is_dark);
  robot_.clock_.wake();
}

bool DobotRobot::OutputGate::is_busy() const {
  return is_pulsing_ || (is_known_off_ && robot_.frame_count_ < known_frame_ + kFramesOfGrace);
}

const char* DobotRobot::OutputGate::fault_in(const dobot::Frame& frame) {
  const bool is_lit = (frame.digital_outputs >> (output_ - 1) & 1) != 0;
  if (!is_lit) return nullptr;
  if (is_known_off_ && robot_.frame_count_ >= known_frame_ + kFramesOfGrace) return "is on without an order";
  if (!is_pulsing_) return nullptr;
  if (!lit_ms_) lit_ms_ = frame.time_ms;
  return frame.time_ms > *lit_ms_ + pulse_ms_ + kOverdueMs ? "is on longer than its pulse" : nullptr;
}

void DobotRobot::OutputGate::pulse(double pulse_s) {
  const long pulse_ms = std::lround(pulse_s * 1e3);
  if (!(pulse_s > 0) || pulse_s > kGatePulseMaxS ||
      std::abs(pulse_s * 1e3 - static_cast<double>(pulse_ms)) > 1e-3 || pulse_ms < 1)
    throw DriverError("the robot times pulses of whole milliseconds only");
  {
    const std::lock_guard lock(robot_.mutex_);
    if (robot_.group_.state != DeviceState::kReady) robot_.group_.refuse("asked for a pulse");
    if (!robot_.group_.is_in_position) throw DriverError("the robot refuses a pulse: it is not in position");
    if (is_pulsing_) throw DriverError("the robot refuses a pulse: the last one is not over");
    is_pulsing_ = true;
    is_known_off_ = false;
    pulse_ms_ = static_cast<std::uint64_t>(pulse_ms);
    lit_ms_.reset();
  }
  const auto commands = dobot::encode_pulse(output_, pulse_ms);
  try {
    robot_.ports_.motion(commands.data(), commands.size(), 1, [this](const dobot::Reply* reply) {
      if (reply == nullptr || reply->error != 0) return;  // not confirmed: stays as it is until off()
      {
        const std::lock_guard lock(robot_.mutex_);
        if (!is_pulsing_) return;
        note_off();
      }
      notify(true);
    });
  } catch (const DriverError&) {
    off();
    throw;
  }
}

/// Turns the output off, empties the queue, and turns the output off again in case the queue turned it on in
/// between. All in one write, because an emptied queue has lost the end of its pulse. A controller in alarm
/// refuses the reset, but its queue is empty.
bool DobotRobot::OutputGate::order_off(bool was_pulsing, double wall_s) noexcept {
  try {
    const std::string off = dobot::encode("DOExecute", {output_, 0});
    std::vector<std::string> commands{off};
    if (was_pulsing) commands = {off, dobot::encode("ResetRobot"), off};
    return robot_.ports_.dashboard_all(commands, wall_s).back().error == 0;
  } catch (const std::exception&) {
    return false;
  }
}

/// While a pulse may be on, a controller that does not answer at once is not waited for: the listener is
/// called first, so that the laser head is disarmed. The second try opens a new connection.
bool DobotRobot::OutputGate::off() noexcept {
  try {
    bool was_pulsing = false;
    {
      const std::lock_guard lock(robot_.mutex_);
      if (is_known_off_ && robot_.group_.state != DeviceState::kDisconnected &&
          robot_.group_.state != DeviceState::kFault)
        return true;
      was_pulsing = is_pulsing_;
    }
    if (!order_off(was_pulsing, was_pulsing ? kFirstTryS : DobotPorts::kUrgentS)) {
      notify(false);
      if (!order_off(was_pulsing, DobotPorts::kUrgentS)) return false;
    }
    if (was_pulsing) robot_.ports_.forget_owed();
    {
      const std::lock_guard lock(robot_.mutex_);
      note_off();
    }
    if (was_pulsing) notify(true);
    return true;
  } catch (const std::exception&) {
    return false;
  }
}

bool DobotRobot::OutputGate::is_on() {
  const std::lock_guard lock(robot_.mutex_);
  if (is_pulsing_) return true;
  const bool is_lit = robot_.frame_count_ > 0 && (robot_.frame_.digital_outputs >> (output_ - 1) & 1) != 0;
  return is_lit && !is_known_off_;
}

}  // namespace hilbrush
