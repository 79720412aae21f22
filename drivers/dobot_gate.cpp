#include "drivers/dobot_gate.h"

#include <cmath>
#include <string>

#include "drivers/driver_error.h"

namespace hilbrush {
namespace {

constexpr std::uint64_t kFramesOfGrace = 4;  ///< until a frame must show an output that was confirmed off
constexpr double kPulseMaxS = 60;

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

void DobotRobot::OutputGate::tell(bool is_dark) {
  Listener listener;
  {
    const std::lock_guard lock(robot_.mutex_);
    listener = listener_;
  }
  if (listener) listener(is_dark);
  robot_.clock_.wake();
}

void DobotRobot::OutputGate::shut() noexcept {
  if (!off()) tell(false);
}

bool DobotRobot::OutputGate::agrees_with(const DobotFrame& frame) {
  const bool is_lit = (frame.digital_outputs >> (output_ - 1) & 1) != 0;
  return !is_lit || !is_known_off_ || robot_.frame_count_ < known_frame_ + kFramesOfGrace;
}

void DobotRobot::OutputGate::pulse(double pulse_s) {
  const long pulse_ms = std::lround(pulse_s * 1e3);
  if (!(pulse_s > 0) || pulse_s > kPulseMaxS || std::abs(pulse_s * 1e3 - static_cast<double>(pulse_ms)) > 1e-3 ||
      pulse_ms < 1)
    throw DriverError("the robot times pulses of whole milliseconds only");
  {
    const std::lock_guard lock(robot_.mutex_);
    if (robot_.state_ != DeviceState::kReady) robot_.refuse("asked for a pulse");
    if (!robot_.is_in_position_) throw DriverError("the robot refuses a pulse: it is not in position");
    if (is_pulsing_) throw DriverError("the robot refuses a pulse: the last one is not over");
    is_pulsing_ = true;
    is_known_off_ = false;
  }
  const auto commands = encode_dobot_pulse(output_, pulse_ms);
  try {
    robot_.ports_.motion(commands.data(), commands.size(), 1, [this](const DobotReply* reply) {
      if (reply == nullptr || reply->error != 0) return;  // not confirmed: stays as it is until off()
      {
        const std::lock_guard lock(robot_.mutex_);
        if (!is_pulsing_) return;
        note_off();
      }
      tell(true);
    });
  } catch (const DriverError&) {
    off();
    throw;
  }
}

/// The first try may meet a connection that had died unnoticed.
void DobotRobot::OutputGate::order_off() {
  const std::string command = encode_dobot("DOExecute", {output_, 0});
  try {
    robot_.ports_.dashboard(command, DobotPorts::kUrgentS);
  } catch (const LinkError&) {
    robot_.ports_.dashboard(command, DobotPorts::kUrgentS);
  }
}

/// Dark first; then the queue is emptied, and what it may have turned on between the two is turned off again.
bool DobotRobot::OutputGate::off() noexcept {
  try {
    bool was_pulsing = false;
    {
      const std::lock_guard lock(robot_.mutex_);
      if (is_known_off_ && robot_.state_ != DeviceState::kDisconnected && robot_.state_ != DeviceState::kFault)
        return true;
      was_pulsing = is_pulsing_;
    }
    order_off();
    if (was_pulsing) {
      try {
        robot_.ports_.dashboard(encode_dobot("ResetRobot"), DobotPorts::kUrgentS);
      } catch (const LinkError&) {
        throw;
      } catch (const DriverError&) {
        // A controller in alarm refuses: its queue is empty.
      }
      order_off();
      robot_.ports_.forget_owed();
    }
    {
      const std::lock_guard lock(robot_.mutex_);
      note_off();
    }
    if (was_pulsing) tell(true);
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
