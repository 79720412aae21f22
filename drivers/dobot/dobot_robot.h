#pragma once
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "drivers/axis_group.h"
#include "drivers/axis_group_state.h"
#include "drivers/clock.h"
#include "drivers/device_options.h"
#include "drivers/dobot/dobot_ports.h"
#include "drivers/gate.h"

namespace hilbrush {

/// A Dobot 4-axis robot (M1 Pro, MG400) over TCP. "Accepted" is not "executed": a move is over when feedback
/// frames show the controller's set-point at the target, the joints within a window of it and at rest, and
/// the controller idle, for the settle time by the controller's own clock. Frames that repeat a time stamp
/// count as silence.
///
/// Threads: the executor's (all that moves), one reader for motion and feedback ports, any for stop(),
/// status() and the gates' off(). The encoders are absolute: home() moves nothing.
class DobotRobot final : public Robot {
 public:
  /// `clock` outlives it; it is woken when status() or a gate changes.
  DobotRobot(const DobotOptions& options, Clock& clock);
  ~DobotRobot() override;

  void connect() override;
  void enable() override;
  void home() override;
  void disable() noexcept override;
  void clear_fault() override;
  void move_to(const Positions& target, double settle_s) override;
  /// Way-points in the controller's queue behind the one under way.
  std::size_t look_ahead() const override { return kLookAhead; }
  Status status() override;
  double expected_arrival_s() override;
  void stop() noexcept override;

  /// The gate on digital output `output` (1...). Pulses are whole milliseconds, queued as on - wait - off;
  /// off() is immediate and clears the queue if a pulse may be in it. Owned by the robot.
  Gate& gate(int output);

  /// What the controller reports about itself, a line each, for the operator. Connected or more. @throws
  /// DriverError
  std::vector<std::string> identify();

 private:
  class OutputGate;
  static constexpr std::size_t kLookAhead = 8;

  double silence_s() const;
  void take_frame(const dobot::Frame& frame);
  bool judge_arrival(const dobot::Frame& frame);
  bool is_at_rest(const dobot::Frame& frame) const;
  bool is_within_window(const dobot::Frame& frame) const;
  void fail(const std::string& sentence);
  void close_gates() noexcept;
  void end_pulses() noexcept;
  void wait_for_alarm_end();
  bool set_fault(const std::string& sentence);
  void wait_for_mode(dobot::Mode mode, double cell_s, const char* participle);
  double travel_s(const dobot::Joints& from, const dobot::Joints& to) const;
  Positions to_si(const dobot::Joints& joints) const;

  const DobotOptions options_;
  Clock& clock_;

  std::mutex mutex_;  ///< of what follows; never held while waiting for the robot
  AxisGroupState<4> group_;
  std::uint64_t frame_count_ = 0;
  dobot::Frame frame_;
  double frame_s_ = 0;  ///< when it came
  dobot::Joints target_{};
  std::size_t queued_ = 0;         ///< targets since it was in position, or stopped
  std::uint64_t accepted_ms_ = 0;  ///< controller's time of the last frame before the target was accepted
  double rest_ms_ = -1;  ///< controller's time since when it rests at the target; negative: it does not
  std::map<int, std::unique_ptr<OutputGate>> gates_;

  DobotPorts ports_;  ///< last: its reader uses all of the above
};

}  // namespace hilbrush
