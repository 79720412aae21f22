#pragma once
#include <functional>
#include <optional>
#include <string>

#include "daemon/server/cell_thread.h"
#include "daemon/server/json_rpc.h"

/// The cell as the operator sees it: stopped (latched; the state at start-up) -> clear -> idle -> arm ->
/// armed -> painting -> idle. Stop comes at any time and is answered at once; clear, arm and resume are three
/// acts of their own. Socket thread only.
namespace hilbrush {

/// The answer to a request that takes a while.
struct Reply {
  std::function<void(Json result)> result;
  std::function<void(RpcFault fault)> fault;
};

class CellController {
 public:
  enum class State { kStopped, kClearing, kIdle, kArming, kArmed, kHoming, kPainting };

  CellController(CellThread& thread, CellDevices& devices, const CellDescription& description);

  State state() const { return state_; }
  const char* state_name() const;

  /// Latched when this returns; the reply, if one is wanted, comes when the laser has confirmed or has failed
  /// to.
  void stop(const std::string& reason, Reply reply = {});
  void clear(Reply reply);
  void arm(Reply reply);
  void home(Reply reply);
  /// {"cell": {...}}
  Json status();

  /// A job takes the cell. @throws RpcFault unless it is armed and at rest.
  void begin_painting(const std::string& job);
  /// The job gives it back; the laser is disarmed unless the job may go on (`stays_armed`). Does nothing if
  /// the cell was stopped meanwhile.
  void end_painting(bool stays_armed);

  /// Called after every stop; set once.
  std::function<void()> on_stop;
  /// Called after a stop that did not come over the socket, with its reason; set once.
  std::function<void(const std::string& reason)> on_own_stop;
  /// Checks the devices while no executor does: one that fails at rest stops the cell, and so does an
  /// interlock that is opened while the laser is armed. To be called several times a second.
  void check_devices();
  /// Why the cell is stopped.
  const std::string& reason() const { return reason_; }
  /// To be called when the executor's thread has answered: a clear that waited for it begins.
  void note_executor_at_rest();

 private:
  void begin_clear(Reply reply);
  /// What answers `reply` when the act that is ordered now has ended: with the state that it `reached`, or,
  /// if a stop came between, with the sentence `overtaken`.
  CellThread::OnActEnd end_of_act(Reply reply, State reached, const char* overtaken);
  void finish_act(const Reply& reply, State reached, const std::optional<CellFault>& fault);
  [[noreturn]] void refuse(const std::string& act) const;

  CellThread& thread_;
  CellDevices& devices_;
  const CellDescription& description_;
  State state_ = State::kStopped;
  std::string reason_ = "the daemon has just started";  ///< why it is stopped
  std::string job_;                                     ///< that paints
  bool is_laser_off_verified_ = true;
  std::optional<Reply> waiting_clear_;
  unsigned stops_ = 0;  ///< tells an act that it was overtaken by a stop
};

}  // namespace hilbrush
