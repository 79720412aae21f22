#include "daemon/server/cell_controller.h"

#include <numbers>

namespace hilbrush {
namespace {

Json axes_json(const char* state, const std::string& fault) {
  return {{"state", state}, {"fault", fault.empty() ? Json(nullptr) : Json(fault)}};
}

/// Millimeters and degrees: for people.
Json joints_json(const Robot::Positions& robot, const Table::Positions& table) {
  constexpr double kDegrees = 180 / std::numbers::pi;
  return {{"j1_deg", robot[kJ1] * kDegrees}, {"j2_deg", robot[kJ2] * kDegrees},
          {"j3_mm", robot[kJ3] * 1e3},       {"j4_deg", robot[kJ4] * kDegrees},
          {"a_deg", table[0] * kDegrees},    {"c_deg", table[1] * kDegrees}};
}

}  // namespace

CellController::CellController(CellThread& thread, CellDevices& devices, const CellDescription& description)
    : thread_(thread), devices_(devices), description_(description) {}

const char* CellController::state_name() const {
  switch (state_) {
    case State::kStopped:
      return "stopped";
    case State::kClearing:
      return "clearing";
    case State::kIdle:
      return "idle";
    case State::kArming:
      return "arming";
    case State::kArmed:
      return "armed";
    case State::kHoming:
      return "homing";
    case State::kPainting:
      return "painting";
  }
  return "unknown";
}

void CellController::refuse(const std::string& act) const {
  throw RpcFault{kRpcWrongState, "the cell is " + std::string(state_name()) + ": " + act, ""};
}

void CellController::stop(const std::string& reason, Reply reply) {
  state_ = State::kStopped;
  is_laser_off_verified_ = false;
  reason_ = reason;
  job_.clear();
  ++stops_;
  if (!reply.result && on_own_stop) on_own_stop(reason);
  thread_.stop([this, reply = std::move(reply)](bool is_laser_off) {
    is_laser_off_verified_ = is_laser_off;
    if (reply.result) reply.result(status());
    note_executor_at_rest();
  });
  if (waiting_clear_) {
    const Reply overtaken = *std::exchange(waiting_clear_, std::nullopt);
    overtaken.fault({kRpcWrongState, "the cell was stopped again before it was cleared", ""});
  }
  if (on_stop) on_stop();
}

void CellController::check_devices() {
  if (state_ != State::kIdle && state_ != State::kArmed) return;
  const Cell cell = devices_.cell();
  const auto check_axes = [this](const char* name, const auto& axes) {
    if (axes.state == DeviceState::kFault)
      stop(std::string("the ") + name + " reports a fault: " + axes.fault);
    if (axes.state == DeviceState::kDisconnected) stop(std::string("the ") + name + " is disconnected");
    return state_ != State::kStopped;
  };
  if (!check_axes("robot", cell.robot.status()) || !check_axes("table", cell.table.status())) return;
  const auto laser = cell.laser.status();
  if (laser.is_emitting) return stop("the laser emits although nothing is painted");
  if (state_ != State::kArmed) return;  // an open interlock at rest is how a part is changed
  if (!laser.interlock_closed) return stop("the interlock was opened");
  if (laser.state != DeviceState::kReady)
    stop(std::string("the laser is no longer armed but ") + device_state_name(laser.state) +
         (laser.fault.empty() ? "" : ": " + laser.fault));
}

/// Repeated, it does nothing: what is to be cleared is cleared already.
/// While the executor still comes to rest after a stop, its flag must stay up: the clear waits.
void CellController::clear(Reply reply) {
  if (state_ == State::kClearing || waiting_clear_) refuse("it is being cleared already");
  if (state_ != State::kStopped) return reply.result(status());
  if (thread_.is_busy())
    waiting_clear_ = std::move(reply);
  else
    begin_clear(std::move(reply));
}

void CellController::note_executor_at_rest() {
  if (!waiting_clear_ || thread_.is_busy()) return;
  begin_clear(*std::exchange(waiting_clear_, std::nullopt));
}

CellThread::OnActEnd CellController::end_of_act(Reply reply, State reached, const char* overtaken) {
  return [this, reply = std::move(reply), reached, overtaken,
          stops = stops_](const std::optional<CellFault>& fault) {
    if (stops != stops_) return reply.fault({kRpcWrongState, overtaken, ""});
    finish_act(reply, reached, fault);
  };
}

void CellController::begin_clear(Reply reply) {
  thread_.release_stop();
  state_ = State::kClearing;
  thread_.clear(
      end_of_act(std::move(reply), State::kIdle, "the cell was stopped again while it was cleared"));
}

void CellController::arm(Reply reply) {
  if (state_ == State::kStopped) refuse("clear the stop first (cell.clear)");
  if (state_ == State::kArmed) return reply.result(status());  // repeated, it does nothing
  if (state_ != State::kIdle) refuse("it can be armed only when idle");
  state_ = State::kArming;
  thread_.arm(end_of_act(std::move(reply), State::kArmed, "the cell was stopped while it was armed"));
}

void CellController::home(Reply reply) {
  if (state_ == State::kStopped) refuse("clear the stop first (cell.clear)");
  if (state_ != State::kIdle && state_ != State::kArmed) refuse("it can be homed only when idle or armed");
  const State before = std::exchange(state_, State::kHoming);
  thread_.home(end_of_act(std::move(reply), before, "the cell was stopped on its way home"));
}

/// A device that fails stops the cell: the operator inspects it, then clears.
void CellController::finish_act(const Reply& reply, State reached, const std::optional<CellFault>& fault) {
  if (fault) {
    stop(fault->sentence);
    reply.fault({kRpcDeviceFault, fault->sentence, "cell"});
    return;
  }
  state_ = reached;
  reply.result(status());
}

void CellController::begin_painting(const std::string& job) {
  if (state_ == State::kStopped) refuse("clear it (cell.clear) and arm it (cell.arm) before a job can paint");
  if (state_ == State::kIdle) refuse("arm it (cell.arm) before a job can paint");
  if (state_ == State::kPainting) refuse("job " + job_ + " is being painted");
  if (state_ != State::kArmed) refuse("a job can paint only when it is armed");
  state_ = State::kPainting;
  job_ = job;
}

void CellController::end_painting(bool stays_armed) {
  job_.clear();
  if (state_ != State::kPainting) return;
  state_ = stays_armed ? State::kArmed : State::kIdle;
  if (!stays_armed) thread_.disarm();
}

Json CellController::status() {
  const Cell cell = devices_.cell();
  const auto robot = cell.robot.status();
  const auto table = cell.table.status();
  const auto laser = cell.laser.status();
  Json json;
  json["state"] = state_name();
  json["laser"] = laser.is_emitting ? "on" : is_laser_off_verified_ ? "off" : "unconfirmed";
  json["interlock"] = laser.interlock_closed ? "closed" : "open";
  json["job"] = job_.empty() ? Json(nullptr) : Json(job_);
  json["reason"] = state_ == State::kStopped ? Json(reason_) : Json(nullptr);
  json["joints"] = joints_json(robot.positions, table.positions);
  json["devices"] = {{"robot", axes_json(device_state_name(robot.state), robot.fault)},
                     {"table", axes_json(device_state_name(table.state), table.fault)},
                     {"laser", axes_json(device_state_name(laser.state), laser.fault)}};
  json["name"] = description_.name;
  json["sha256"] = description_.sha256;
  json["simulated"] = devices_.is_simulated();
  if (devices_.is_simulated()) json["time_scale"] = description_.simulation.time_scale;
  return {{"cell", std::move(json)}};
}

}  // namespace hilbrush
