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

void DobotRobot::OutputGate::set_listener(std::function<void()> on_dark) {
  const std::lock_guard lock(robot_.mutex_);
  on_dark_ = std::move(on_dark);
}

void DobotRobot::OutputGate::tell_dark() {
  std::function<void()> listener;
  {
    const std::lock_guard lock(robot_.mutex_);
    listener = on_dark_;
  }
  if (listener) listener();
  robot_.clock_.wake();
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
      tell_dark();
    });
  } catch (const DriverError&) {
    off();
    throw;
  }
}

/// The queue is emptied first: a pulse that waits in it must not begin after the output was turned off.
bool DobotRobot::OutputGate::off() noexcept {
  try {
    bool was_pulsing = false;
    {
      const std::lock_guard lock(robot_.mutex_);
      if (is_known_off_ && robot_.state_ != DeviceState::kDisconnected && robot_.state_ != DeviceState::kFault)
        return true;
      was_pulsing = is_pulsing_;
    }
    for (int attempt = 0;; ++attempt) {
      try {
        if (was_pulsing) robot_.ports_.dashboard(encode_dobot("ResetRobot"), DobotPorts::kUrgentS);
        robot_.ports_.dashboard(encode_dobot("DOExecute", {output_, 0}), DobotPorts::kUrgentS);
        break;
      } catch (const LinkError&) {
        if (attempt == 1) return false;  // the first try may have met a connection that had died unnoticed
      }
    }
    if (was_pulsing) robot_.ports_.forget_owed();
    {
      const std::lock_guard lock(robot_.mutex_);
      note_off();
    }
    if (was_pulsing) tell_dark();
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
