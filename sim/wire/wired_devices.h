#pragma once
#include <memory>
#include <vector>

#include "sim/wire/axis_banks.h"
#include "sim/wire/dobot_controller.h"
#include "sim/wire/modbus_server.h"
#include "sim/wire/wire_options.h"

/// The devices of the simulated cell with all that they share, without sockets and without a clock: the owner
/// makes sessions for its connections and passes the time. One thread.
namespace hilbrush {

class WiredDevices {
 public:
  WiredDevices(const CellDescription& description, const WireOptions& options);

  /// Every event at its own time, up to now_s: a late call changes no pulse.
  void advance(double now_s);
  /// After something was done to the cell from outside: lets the devices see it.
  void observe();
  /// The next instant at which something happens by itself (what sessions have to send is theirs).
  double next_event_s() const;

  enum class Conversation { kDashboard, kMotion, kFeedback, kTableTcp, kTableRtu, kLaser };
  std::unique_ptr<WireSession> converse(Conversation about);

  TrueCell& cell() { return cell_; }
  FaultInjector& faults() { return faults_; }
  DobotController& robot() { return robot_; }
  DriveAxis& table_axis(std::size_t i) { return banks_[i]->drive(); }
  TimeRecord& times() { return times_; }

 private:
  const WireOptions options_;
  TimeRecord times_;
  TrueCell cell_;
  FaultInjector faults_;
  DobotController robot_;
  std::vector<std::unique_ptr<DriveBank>> banks_;  ///< tilt, rotation: units 1 and 2
};

}  // namespace hilbrush
