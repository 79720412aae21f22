#include "daemon/executor.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "drivers/driver_error.h"
#include "planner/time_model.h"

namespace hilbrush {
namespace {

constexpr double kJointTolerance = 1e-9;  ///< rad or m: what arithmetic may put outside a limit
constexpr double kGraceS = 5;         ///< how much later than the time model a move may end before it counts as lost
constexpr double kPulseGraceS = 0.1;  ///< the same for a pulse

/// Ends a run early without a fault; carries no text because it is thrown on the ordinary way out of a stop or a pause.
struct RunEnded {
  ExecutionOutcome outcome;
};

/// The program asks for something outside the limits: no device is to blame.
struct ProgramRefused : std::runtime_error {
  using std::runtime_error::runtime_error;
};

std::string millimetres_or_degrees(int axis, double value) {
  const bool is_prismatic = axis == kJ3;
  const double figure = is_prismatic ? value * 1e3 : value * 180 / 3.14159265358979323846;
  std::string text = std::to_string(std::round(figure * 1e3) / 1e3);
  text.erase(text.find_last_not_of('0') + 1);
  if (!text.empty() && text.back() == '.') text.pop_back();
  return text + (is_prismatic ? " mm" : " degrees");
}

Robot::Positions robot_part(const Joints& joints) {
  return {joints[kJ1], joints[kJ2], joints[kJ3], joints[kJ4]};
}
Table::Positions table_part(const Joints& joints) {
  return {joints[kTilt], joints[kRotation]};
}

/// One run of a program. Devices are touched by this class and request_stop() only.
class Run {
 public:
  Run(const ExposureProgram& program, const Cell& cell, const CellDescription& description, Journal& journal,
      ExecutionControl& control)
      : program_(program), cell_(cell), description_(description), journal_(journal), control_(control) {}

  void travel_all(const std::vector<Joints>& way);
  void expose_all(const std::vector<Joints>& approach, const ExecutionProgress& progress);
  std::size_t exposed() const { return exposed_; }

 private:
  void check_axes_ready();
  void check_laser_ready();
  void check_pose(const Joints& target, std::size_t exposure) const;
  void check_pulse(const Exposure& exposure, std::size_t i) const;
  void prove_laser_off();
  void end_if_asked() const;
  enum class Rest { kPassing, kSettled };
  void move(const Joints& target, Rest rest);
  void wait_in_position(double deadline_s);
  void visit_approach(const std::vector<Joints>& approach);
  void visit_vias(std::size_t i);
  void expose(std::size_t i);
  void wait_pulse_end(const Exposure& exposure);

  const ExposureProgram& program_;
  const Cell& cell_;
  const CellDescription& description_;
  Journal& journal_;
  ExecutionControl& control_;

  Laser::Limits laser_limits_;
  Joints at_{};                                   ///< where the last finished move ended
  std::optional<Robot::Positions> robot_target_;  ///< what each chain was last told in this run
  std::optional<Table::Positions> table_target_;
  double rung_down_s_ = 0;  ///< when what was passed without settling will be at rest, on the cell's clock
  std::size_t next_via_ = 0;
  std::size_t exposed_ = 0;
};

void Run::end_if_asked() const {
  if (control_.stop.load()) throw RunEnded{ExecutionOutcome::kStopped};
}

void Run::prove_laser_off() {
  if (!cell_.laser.off()) throw DriverError("the laser does not confirm that it is off");
}

void Run::check_axes_ready() {
  prove_laser_off();
  const auto robot = cell_.robot.status();
  const auto table = cell_.table.status();
  if (robot.state != DeviceState::kReady)
    throw DriverError(std::string("the robot is not ready but ") + device_state_name(robot.state));
  if (table.state != DeviceState::kReady)
    throw DriverError(std::string("the table is not ready but ") + device_state_name(table.state));
  std::copy(robot.positions.begin(), robot.positions.end(), at_.begin());
  std::copy(table.positions.begin(), table.positions.end(), at_.begin() + kTilt);
}

void Run::check_laser_ready() {
  const auto laser = cell_.laser.status();
  if (!laser.interlock_closed) throw DriverError("the interlock is open");
  if (laser.state != DeviceState::kReady)
    throw DriverError(std::string("the laser is not armed but ") + device_state_name(laser.state) +
                      (laser.fault.empty() ? "" : ": " + laser.fault));
}

/// Whatever the planner said: outside the cell's limits nothing moves. The comparisons are written so that NaN fails
/// them.
void Run::check_pose(const Joints& target, std::size_t exposure) const {
  for (int axis = 0; axis < kAxisCount; ++axis) {
    const auto& limits = description_.axes[static_cast<std::size_t>(axis)];
    const double value = target[static_cast<std::size_t>(axis)];
    if (value >= limits.min - kJointTolerance && value <= limits.max + kJointTolerance) continue;
    throw ProgramRefused("the program asks axis " + std::string(kAxisNames[static_cast<std::size_t>(axis)]) + " for " +
                         millimetres_or_degrees(axis, value) + " at exposure " + std::to_string(exposure) +
                         ", outside its limits " + millimetres_or_degrees(axis, limits.min) + " to " +
                         millimetres_or_degrees(axis, limits.max));
  }
}

void Run::check_pulse(const Exposure& exposure, std::size_t i) const {
  constexpr double kRelative = 1e-6;  // program files keep floats
  const double power = exposure.power_w, pulse = exposure.pulse_s;
  const auto within = [](double value, double low, double high) {
    return value >= low * (1 - kRelative) && value <= high * (1 + kRelative);
  };
  if (!within(power, laser_limits_.power_min_w, laser_limits_.power_max_w))
    throw ProgramRefused("exposure " + std::to_string(i) + " asks for " + std::to_string(power) +
                         " W, outside the laser's limits");
  if (!within(pulse, laser_limits_.pulse_min_s, laser_limits_.pulse_max_s))
    throw ProgramRefused("exposure " + std::to_string(i) + " asks for a pulse of " + std::to_string(pulse) +
                         " s, outside the laser's limits");
}

/// Both chains start together. A chain that rests where it shall be isn't commanded again, but its in_position is
/// required. Way-points are passed without waiting for the axes to ring down, so what is left of that is added to the
/// settling of the move that ends in an exposure.
void Run::move(const Joints& target, Rest rest) {
  end_if_asked();
  prove_laser_off();
  const double now_s = cell_.clock.now_s();
  const double travel_s = move_s(description_, at_, target);
  const double ring_s = std::max(settle_s(description_, at_, target), rung_down_s_ - (now_s + travel_s));
  const double settle = rest == Rest::kSettled ? ring_s : 0;
  const auto robot_target = robot_part(target);
  const auto table_target = table_part(target);
  const bool is_ringing = rung_down_s_ > now_s;
  const bool moves_robot = is_ringing || robot_target_ != robot_target;
  const bool moves_table = is_ringing || table_target_ != table_target;
  robot_target_ = robot_target;
  table_target_ = table_target;
  if (moves_robot) cell_.robot.move_to(robot_target, settle);
  if (moves_table) cell_.table.move_to(table_target, settle);
  wait_in_position(now_s + 2 * travel_s + settle + kGraceS);
  rung_down_s_ = rest == Rest::kSettled ? 0 : cell_.clock.now_s() + ring_s;
  at_ = target;
}

void Run::wait_in_position(double deadline_s) {
  for (;;) {
    const double arrival_s = std::max(cell_.robot.expected_arrival_s(), cell_.table.expected_arrival_s());
    // After a stop was asked for, the axes have been stopped too: nothing to wait for.
    end_if_asked();
    if (arrival_s > cell_.clock.now_s()) cell_.clock.sleep_until(std::min(arrival_s, deadline_s));
    end_if_asked();
    const auto robot = cell_.robot.status();
    const auto table = cell_.table.status();
    if (robot.state == DeviceState::kFault) throw DriverError("the robot reports a fault: " + robot.fault);
    if (table.state == DeviceState::kFault) throw DriverError("the table reports a fault: " + table.fault);
    if (robot.in_position && table.in_position) return;
    const double now_s = cell_.clock.now_s();
    if (now_s >= deadline_s)
      throw DriverError(std::string("the ") + (robot.in_position ? "table" : "robot") +
                        " is not in position long after its move should have ended");
    if (arrival_s <= now_s) cell_.clock.sleep_until(now_s + description_.timing.tick_s);
  }
}

void Run::travel_all(const std::vector<Joints>& way) {
  check_axes_ready();
  visit_approach(way);
}

void Run::visit_approach(const std::vector<Joints>& approach) {
  for (const Joints& via : approach) {
    check_pose(via, 0);
    move(via, Rest::kPassing);
  }
}

void Run::visit_vias(std::size_t i) {
  for (; next_via_ < program_.vias.size() && program_.vias[next_via_].before_exposure <= i; ++next_via_) {
    check_pose(program_.vias[next_via_].joints, i);
    move(program_.vias[next_via_].joints, Rest::kPassing);
  }
}

/// The pulse's length is the device's business; here is only waited for its end.
void Run::wait_pulse_end(const Exposure& exposure) {
  const double end_s = cell_.clock.now_s() + exposure.pulse_s;
  const double deadline_s = end_s + kPulseGraceS;
  while (!control_.stop.load()) {
    const double now_s = cell_.clock.now_s();
    if (now_s < end_s) {
      cell_.clock.sleep_until(end_s);
      continue;
    }
    if (!cell_.laser.status().is_emitting) return;
    if (now_s >= deadline_s) throw DriverError("the laser still emits long after its pulse should have ended");
    cell_.clock.sleep_until(now_s + description_.timing.tick_s);
  }
}

void Run::expose(std::size_t i) {
  const Exposure& exposure = program_.exposures[i];
  check_laser_ready();
  end_if_asked();
  if (control_.pause.load()) throw RunEnded{ExecutionOutcome::kPaused};

  journal_.arm(i);
  try {
    cell_.laser.fire(exposure.power_w, exposure.pulse_s);
    wait_pulse_end(exposure);
    prove_laser_off();
    // Whoever cuts a pulse sets the flag before, so a flag that is still clear here means that the pulse was whole.
    end_if_asked();
    const auto after = cell_.laser.status();
    if (!after.interlock_closed) throw DriverError("the interlock was opened during a pulse");
    if (after.state != DeviceState::kReady)
      throw DriverError(std::string("the laser went to state ") + device_state_name(after.state) + " during a pulse" +
                        (after.fault.empty() ? "" : ": " + after.fault));
  } catch (...) {
    cell_.laser.off();
    journal_.doubt(i);
    throw;
  }
  journal_.done(i);
  ++exposed_;
}

void Run::expose_all(const std::vector<Joints>& approach, const ExecutionProgress& progress) {
  check_axes_ready();
  check_laser_ready();
  laser_limits_ = cell_.laser.limits();
  const std::size_t count = program_.exposures.size();
  std::size_t first = 0;
  while (first < count && journal_.state(first) != ExposureState::kRemaining) ++first;
  if (first == count) return;
  while (next_via_ < program_.vias.size() && program_.vias[next_via_].before_exposure <= first) ++next_via_;

  for (std::size_t i = first; i < count; ++i) {
    end_if_asked();
    if (control_.pause.load()) throw RunEnded{ExecutionOutcome::kPaused};
    const bool is_exposed = journal_.state(i) == ExposureState::kRemaining;
    const Joints& target = program_.exposures[i].joints;
    check_pose(target, i);
    if (is_exposed) check_pulse(program_.exposures[i], i);
    if (i == first)
      visit_approach(approach);
    else
      visit_vias(i);
    move(target, is_exposed ? Rest::kSettled : Rest::kPassing);
    if (!is_exposed) continue;
    expose(i);
    if (progress) progress(journal_.done_count());
  }
  visit_vias(count);  // the way home
}

/// The laser first, then motion; both, whatever the other answers.
void make_safe(const Cell& cell) noexcept {
  cell.laser.off();
  cell.robot.stop();
  cell.table.stop();
}

/// Every way out of a run: the beam is off, and unless the work ended by itself, the axes are stopped.
template <class Work>
ExecutionResult run_guarded(const Cell& cell, const ExecutionControl& control, Work work) {
  ExecutionResult result;
  const double begin_s = cell.clock.now_s();
  try {
    work();
    cell.laser.off();
  } catch (const RunEnded& ended) {
    make_safe(cell);
    result.outcome = ended.outcome;
  } catch (const ProgramRefused& refusal) {
    make_safe(cell);
    result.outcome = ExecutionOutcome::kFailed;
    result.reason = refusal.what();
    result.is_program_at_fault = true;
  } catch (const std::exception& error) {
    make_safe(cell);
    // A device that refuses because it was just stopped is no fault.
    result.outcome = control.stop.load() ? ExecutionOutcome::kStopped : ExecutionOutcome::kFailed;
    result.reason = error.what();
  }
  if (result.outcome == ExecutionOutcome::kStopped) result.reason = "the cell was stopped";
  result.elapsed_s = cell.clock.now_s() - begin_s;
  return result;
}

}  // namespace

ExecutionResult execute(const ExposureProgram& program, const std::vector<Joints>& approach, const Cell& cell,
                        const CellDescription& description, Journal& journal, ExecutionControl& control,
                        const ExecutionProgress& progress) {
  Run run(program, cell, description, journal, control);
  ExecutionResult result = run_guarded(cell, control, [&] {
    if (journal.exposure_count() != program.exposures.size())
      throw ProgramRefused("the journal belongs to a program of another length");
    run.expose_all(approach, progress);
  });
  result.exposed = run.exposed();
  return result;
}

ExecutionResult travel(const std::vector<Joints>& way, const Cell& cell, const CellDescription& description,
                       ExecutionControl& control) {
  const ExposureProgram no_program;
  Journal no_journal = Journal::in_memory(0);
  Run run(no_program, cell, description, no_journal, control);
  return run_guarded(cell, control, [&] { run.travel_all(way); });
}

void bring_up(const Cell& cell) {
  const auto ready = [](auto& axes) {
    if (axes.status().state == DeviceState::kDisconnected) axes.connect();
    if (axes.status().state == DeviceState::kConnected) axes.enable();
    if (axes.status().state == DeviceState::kEnabled) axes.home();
  };
  if (cell.laser.status().state == DeviceState::kDisconnected) cell.laser.connect();
  if (!cell.laser.off()) throw DriverError("the laser does not confirm that it is off");
  ready(cell.robot);
  ready(cell.table);
  if (cell.laser.status().state == DeviceState::kConnected) cell.laser.enable();
}

bool request_stop(const Cell& cell, ExecutionControl& control) noexcept {
  control.stop.store(true);
  const bool is_off = cell.laser.off();
  cell.laser.disable();
  cell.robot.stop();
  cell.table.stop();
  cell.clock.wake();
  return is_off;
}

}  // namespace hilbrush
