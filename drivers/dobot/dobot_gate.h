#pragma once
#include <cstdint>
#include <functional>
#include <optional>

#include "drivers/clock.h"
#include "drivers/dobot/dobot_robot.h"

namespace hilbrush {

/// One digital output of the robot as a gate. What is known of it, and from when, is kept apart from what the
/// frames show: a frame may be older than the last answer.
class DobotRobot::OutputGate final : public Gate {
 public:
  OutputGate(DobotRobot& robot, int output) : robot_(robot), output_(output) {}

  double resolution_s() const override { return 1e-3; }
  void pulse(double pulse_s) override;
  bool off() noexcept override;
  bool is_on() override;
  void set_listener(Listener listener) override;

  /// Reader's thread, under the robot's mutex: what is wrong if the output is on without an order, or longer
  /// than its pulse; else nothing.
  const char* fault_in(const dobot::Frame& frame);
  bool is_pulsing() const { return is_pulsing_; }  ///< under the robot's mutex
  /// A pulse is queued or just over, so that the controller may still report "running". Under the robot's
  /// mutex.
  bool is_busy() const;
  /// The robot was disconnected or lost: nothing is known. Under the robot's mutex.
  void forget() { is_known_off_ = false; }

 private:
  void note_off();
  void notify(bool is_dark);
  bool order_off(bool was_pulsing, double wall_s) noexcept;

  DobotRobot& robot_;
  const int output_;
  Listener listener_;
  bool is_pulsing_ = false;        ///< ordered and not confirmed over; under the robot's mutex, like the rest
  bool is_known_off_ = false;      ///< confirmed by the controller, and nothing ordered since
  std::uint64_t known_frame_ = 0;  ///< frames that had come by then
  std::uint64_t pulse_ms_ = 0;     ///< of the pulse that is not over
  std::optional<std::uint64_t> lit_ms_;  ///< controller's time of the first frame that showed it on
};

}  // namespace hilbrush
