#pragma once
#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "sim/wire/fault_injector.h"
#include "sim/wire/time_record.h"
#include "sim/wire/wire_session.h"

/// A Dobot 4-axis controller: one queue of motion, waits and outputs, its state, and the three conversations
/// about them (dashboard, motion, feedback). Joints in degrees, J3 in mm, as the wire has them.
///
/// Three properties of real controllers matter for safety: "accepted" on the motion port is not "done";
/// outputs keep their level when the queue is cleared by ResetRobot, an alarm or a power cut of the drives;
/// the queue goes on when the host has disconnected.
///
/// After "TCP/IP Remote Control Interface Guide (4axis)", controller V1.6. Joint-space motion only
/// (JointMovJ, MovJ, MoveJog); straight lines are refused as unknown.
namespace hilbrush {

struct DobotControllerOptions {
  int gate_output = 1;    ///< the digital output that is wired to the laser's gate
  double enable_s = .2;   ///< what EnableRobot takes
  double frame_s = .008;  ///< between two feedback frames
};

class DobotController {
 public:
  static constexpr std::size_t kQueueMax = 256;
  static constexpr std::size_t kFrameBytes = 1440;

  DobotController(TrueCell& cell, FaultInjector& faults, TimeRecord& times,
                  const DobotControllerOptions& options = {});

  /// What the dashboard or the motion port answers to a command, up to and without the echo: "0,{5},".
  std::string dashboard(const std::string& name, const std::vector<std::string>& arguments);
  std::string motion(const std::string& name, const std::vector<std::string>& arguments);

  /// Works the queue off up to the present.
  void run();
  /// When the queue goes on by itself; the ends of motions are the cell's events.
  double next_event_s() const;
  bool is_queue_done() const { return queue_.empty() && !current_; }
  /// How many items have been put into the queue, and how many are done or dropped: for Sync.
  std::uint64_t accepted_count() const { return accepted_; }
  std::uint64_t ended_count() const { return accepted_ - queue_.size() - (current_ ? 1 : 0); }
  /// How often the queue was dropped with something in it: a Sync that waits for that fails.
  std::uint64_t dropped_count() const { return dropped_; }
  int mode() const;
  void raise_alarm(int id);
  /// The frame of the present.
  std::string frame();
  const DobotControllerOptions& options() const { return options_; }

 private:
  struct Move {
    std::array<double, 4> target;  ///< rad, m
    double speed_scale;
  };
  struct Output {
    int index;
    bool is_on;
  };
  struct Wait {
    double duration_s;
  };
  using Item = std::variant<Move, Output, Wait>;
  using Arguments = std::vector<std::string>;

  struct State {
    int mode = 4;
    std::array<double, 4> positions{};
    std::array<double, 4> speeds{};
    std::array<double, 4> targets{};
  };
  State present() const;
  std::string joint_move(const Arguments& arguments, bool is_pose);
  std::string output_command(const Arguments& arguments, bool is_queued);
  std::string jog(const Arguments& arguments);
  std::string accept(Item item);
  std::string set_ratio(const Arguments& arguments, double& ratio);
  std::string reset();
  void begin(const Item& item);
  void set_output(int index, bool is_on);
  bool is_moving() const;
  bool is_enabled() const { return is_enabled_ && cell_.now_s() >= enabled_s_; }

  TrueCell& cell_;
  FaultInjector& faults_;
  TimeRecord& times_;
  const DobotControllerOptions options_;
  bool is_enabled_ = false;
  bool is_paused_ = false;
  bool is_jogging_ = false;
  double enabled_s_ = 0;
  int alarm_ = 0;
  double speed_factor_ = 1;
  double joint_speed_ = 1;
  double joint_acceleration_ = 1;
  std::uint64_t outputs_ = 0;
  std::deque<Item> queue_;
  std::optional<Item> current_;
  double current_end_s_ = 0;  ///< of a wait
  std::uint64_t accepted_ = 0;
  std::uint64_t dropped_ = 0;
  std::optional<State> stale_;
  State last_;
};

/// A conversation in text: `Name(p1,p2)` one after another, answered with "ErrorID,{values},Name(p1,p2);".
class DobotTextSession final : public WireSession {
 public:
  enum class Port { kDashboard, kMotion };
  DobotTextSession(Port port, DobotController& controller, TrueCell& cell, FaultInjector& faults)
      : WireSession(WireDevice::kRobot, cell, faults), port_(port), controller_(controller) {}
  void run() override;

 protected:
  std::size_t message_bytes(std::string_view buffer) const override;
  std::string answer(std::string_view message) override;
  std::string refusal(std::string_view message, bool has_failed) override;
  std::string misaddressed(std::string answer) const override;

 private:
  struct Sync {
    std::uint64_t until, dropped;
    std::string command;
  };
  const Port port_;
  DobotController& controller_;
  std::deque<Sync> syncs_;
};

/// Sends a frame every frame_s, at whole multiples of it; takes nothing.
class DobotFeedbackSession final : public WireSession {
 public:
  DobotFeedbackSession(DobotController& controller, TrueCell& cell, FaultInjector& faults);
  void run() override;
  double next_event_s() const override;

 protected:
  std::size_t message_bytes(std::string_view buffer) const override { return buffer.size(); }
  std::string answer(std::string_view) override { return {}; }
  std::string refusal(std::string_view, bool) override { return {}; }
  std::string misaddressed(std::string answer) const override { return answer; }

 private:
  DobotController& controller_;
  double next_frame_s_;
};

}  // namespace hilbrush
