#include "daemon/execution/executor.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include "daemon/execution/program_limits.h"
#include "drivers/driver_error.h"
#include "planner/cell_model/time_model.h"

namespace hilbrush {
namespace {

constexpr double kGraceS = 5;  ///< how much later than the time model a move may end before it counts as lost
constexpr double kPulseGraceS = 0.1;  ///< the same for a pulse
/// At least this much on the wall, however fast the cell's clock runs: this host, its network and its
/// scheduler do not run faster with it.
constexpr double kWallGraceS = 0.25;

/// A status must not be older than this, in seconds, when a pulse begins and when it is believed: on a busy
/// machine the thread that listens to a device may have to wait while an axis drifts. Several frames, or
/// readings.
constexpr double kStatusAgeMaxS = 0.03;
constexpr double kStatusAgeMaxWallS = 0.005;

constexpr double kReadingWallS = 2;  ///< for a laser to report a pulse that is over

double grace_s(const Clock& clock, double cell_s, double wall_min_s = kWallGraceS) {
  const double wall_of_one = clock.wall_s(1);
  return wall_of_one > 0 ? std::max(cell_s, wall_min_s / wall_of_one) : cell_s;
}

/// Ends a run early without a fault; carries no text because it is thrown on the ordinary way out of a stop
/// or a pause.
struct RunEnded {
  ExecutionOutcome outcome;
};

/// How far the measured positions may be from a target that a device reports as reached: catches an answer to
/// an earlier move. The windows of the devices themselves are far smaller.
constexpr double kPositionWindow = 3.5e-4;  ///< rad, 0.02 degrees
constexpr double kPrismaticWindow = 2e-5;   ///< m

Robot::Positions robot_part(const Joints& joints) {
  return {joints[kJ1], joints[kJ2], joints[kJ3], joints[kJ4]};
}
Table::Positions table_part(const Joints& joints) {
  return {joints[kTilt], joints[kRotation]};
}
template <std::size_t N>
typename AxisGroup<N>::Positions chain_part(const Joints& joints) {
  if constexpr (N == 4)
    return robot_part(joints);
  else
    return table_part(joints);
}

template <std::size_t N>
bool is_near(const std::array<double, N>& measured, const std::array<double, N>& target) {
  for (std::size_t i = 0; i < N; ++i)
    if (!(std::abs(measured[i] - target[i]) <= (N == 4 && i == kJ3 ? kPrismaticWindow : kPositionWindow)))
      return false;
  return true;
}

/// @throws DriverError unless the chain moves or may move.
template <class Status>
void check_under_way(const char* chain, const Status& status) {
  if (status.state == DeviceState::kReady || status.state == DeviceState::kMoving) return;
  if (status.state == DeviceState::kFault)
    throw DriverError(std::string("the ") + chain + " reports a fault: " + status.fault);
  throw DriverError(std::string("the ") + chain + " is no longer ready but " +
                    device_state_name(status.state));
}

/// One run of a program. Devices are touched by this class and request_stop() only.
class Run {
 public:
  Run(const ExposureProgram& program, const Cell& cell, const CellDescription& description, Journal& journal,
      ExecutionControl& control)
      : program_(program), cell_(cell), description_(description), journal_(journal), control_(control) {}

  void travel_all(const std::vector<Joints>& path);
  void expose_all(const std::vector<Joints>& approach, const ExecutionProgress& progress);
  std::size_t exposed() const { return exposed_; }
  const DurationHistogram& own_time() const { return own_time_; }
  const MotionTimes& motion() const { return motion_; }

 private:
  enum class Rest { kPassing, kSettled };
  /// What is sent for one or more waypoints at once.
  struct Leg {
    std::span<const Joints> path;
    bool moves_robot = false;
    bool moves_table = false;
    double travel_s = 0;
    double settle_s = 0;  ///< at its end, if it ends in an exposure
  };

  void check_axes_ready();
  void check_laser_ready();
  void verify_laser_off();
  void end_if_asked() const;
  void end_if_asked_or_paused() const;
  std::span<const Via> vias_of(std::size_t i);
  void follow(std::span<const Joints> path, Rest rest);
  Leg plan_leg(std::span<const Joints> path, Rest rest, double now_s) const;
  std::size_t waypoints_at_once(std::span<const Joints> path) const;
  void move(const Leg& leg, Rest rest);
  template <std::size_t N>
  void send(AxisGroup<N>& chain, const Leg& leg, double settle_s);
  void wait_in_position(double deadline_s);
  void prepare_exposure();
  void expose(std::size_t i);
  void prepare_next(std::size_t i);
  template <std::size_t N>
  void prepare_chain(AxisGroup<N>& chain, const typename AxisGroup<N>::Positions& sent, std::size_t next);
  void wait_for_fresh_status();
  void check_in_place(const char* when);
  void check_pulse_conditions(const Laser::Status& laser);
  void wait_pulse_end(double fired_s, const Exposure& exposure);
  void count_own_time() { own_s_ += cell_.clock.now_s() - idle_since_s_; }

  const ExposureProgram& program_;
  const Cell& cell_;
  const CellDescription& description_;
  Journal& journal_;
  ExecutionControl& control_;

  Laser::Limits laser_limits_;
  Joints at_{};                                   ///< where the last finished move ended
  std::optional<Robot::Positions> robot_target_;  ///< last sent to each chain in this run
  std::optional<Table::Positions> table_target_;
  double rung_down_s_ = 0;  ///< when what was passed without settling will be at rest, on the cell's clock
  bool is_off_verified_ = false;   ///< since the last pulse
  std::vector<Joints> path_;       ///< to the exposure under way
  std::size_t next_exposure_ = 0;  ///< that exposure
  std::size_t next_via_ = 0;
  std::size_t exposed_ = 0;
  DurationHistogram own_time_;
  MotionTimes motion_;
  double idle_since_s_ = 0;  ///< the devices have nothing to do since then: our time
  double own_s_ = 0;         ///< of it, for the exposure under way
};

void Run::end_if_asked() const {
  if (control_.stop.load()) throw RunEnded{ExecutionOutcome::kStopped};
}

void Run::end_if_asked_or_paused() const {
  end_if_asked();
  if (control_.pause.load()) throw RunEnded{ExecutionOutcome::kPaused};
}

/// One exchange with the device after each pulse, and at the beginning; the laser then stays off
/// until the next pulse, which only this class orders. The last frame is checked every time: that costs
/// nothing.
void Run::verify_laser_off() {
  if (!is_off_verified_ && !cell_.laser.off()) throw DriverError("the laser does not confirm that it is off");
  is_off_verified_ = true;
  if (!cell_.laser.status().is_emitting) return;
  is_off_verified_ = false;
  throw DriverError("the laser emits although it was turned off");
}

void Run::check_axes_ready() {
  verify_laser_off();
  // After a stop the axes may still be braking.
  const double deadline_s = cell_.clock.now_s() + grace_s(cell_.clock, kGraceS);
  auto robot = cell_.robot.status();
  auto table = cell_.table.status();
  while ((robot.state == DeviceState::kMoving || table.state == DeviceState::kMoving) &&
         cell_.clock.now_s() < deadline_s) {
    end_if_asked();
    cell_.clock.sleep_until(cell_.clock.now_s() + description_.timing.tick_s);
    robot = cell_.robot.status();
    table = cell_.table.status();
  }
  if (robot.state != DeviceState::kReady)
    throw DriverError(std::string("the robot is not ready but ") + device_state_name(robot.state));
  if (table.state != DeviceState::kReady)
    throw DriverError(std::string("the table is not ready but ") + device_state_name(table.state));
  std::copy(robot.positions.begin(), robot.positions.end(), at_.begin());
  std::copy(table.positions.begin(), table.positions.end(), at_.begin() + kTilt);
  idle_since_s_ = cell_.clock.now_s();
  rung_down_s_ = idle_since_s_ + description_.timing.settle_max_s;  // of a move that a stop has cut short
}

void Run::check_laser_ready() {
  const auto laser = cell_.laser.status();
  if (!laser.interlock_closed) throw DriverError("the interlock is open");
  if (laser.state != DeviceState::kReady)
    throw DriverError(std::string("the laser is not armed but ") + device_state_name(laser.state) +
                      (laser.fault.empty() ? "" : ": " + laser.fault));
}

/// Both chains start together at each waypoint, because that is how the path was checked. Where only one of
/// them moves, a device that can buffer gets several waypoints at once.
std::size_t Run::waypoints_at_once(std::span<const Joints> path) const {
  const bool moves_robot = robot_target_ != robot_part(path[0]);
  const bool moves_table = table_target_ != table_part(path[0]);
  if (moves_robot == moves_table) return 1;
  const std::size_t most =
      std::min(path.size(), 1 + (moves_robot ? cell_.robot.look_ahead() : cell_.table.look_ahead()));
  const auto other_rests = [&](std::size_t i) {
    return moves_robot ? table_part(path[i]) == table_part(path[i - 1])
                       : robot_part(path[i]) == robot_part(path[i - 1]);
  };
  std::size_t count = 1;
  while (count < most && other_rests(count)) ++count;
  return count;
}

/// A chain that already rests at its target is not commanded again, but must report in_position. Waypoints
/// are passed without waiting for the axes to ring down, so what is left of that is added to the settling of
/// the move that ends in an exposure.
Run::Leg Run::plan_leg(std::span<const Joints> path, Rest rest, double now_s) const {
  Leg leg;
  leg.path = path;
  Joints from = at_;
  double rung_down_s = rung_down_s_;
  for (const Joints& target : path) {
    leg.travel_s += move_s(description_, from, target);
    leg.settle_s = std::max(settle_s(description_, from, target), rung_down_s - (now_s + leg.travel_s));
    rung_down_s = now_s + leg.travel_s + leg.settle_s;
    from = target;
  }
  const bool must_ring_down = rest == Rest::kSettled && rung_down_s_ > now_s;
  const auto moves = [&](const auto& sent, auto part) {
    return must_ring_down ||
           std::any_of(path.begin(), path.end(), [&](const Joints& target) { return sent != part(target); });
  };
  leg.moves_robot = moves(robot_target_, robot_part);
  leg.moves_table = moves(table_target_, table_part);
  return leg;
}

/// A chain that rests on the whole leg is sent its position once, so that it settles.
template <std::size_t N>
void Run::send(AxisGroup<N>& chain, const Leg& leg, double settle_s) {
  const auto part = [](const Joints& joints) { return chain_part<N>(joints); };
  const bool rests = std::all_of(leg.path.begin(), leg.path.end(), [&](const Joints& target) {
    return part(target) == part(leg.path.front());
  });
  const auto path = rests ? leg.path.last(1) : leg.path;
  for (const Joints& target : path) chain.move_to(part(target), &target == &path.back() ? settle_s : 0);
}

void Run::move(const Leg& leg, Rest rest) {
  end_if_asked();
  verify_laser_off();
  const double settle = rest == Rest::kSettled ? leg.settle_s : 0;
  robot_target_ = robot_part(leg.path.back());
  table_target_ = table_part(leg.path.back());
  count_own_time();
  const double ordered_s = cell_.clock.now_s();
  if (leg.moves_robot) send(cell_.robot, leg, settle);
  if (leg.moves_table) send(cell_.table, leg, settle);
  const double sent_s = cell_.clock.now_s();
  const Joints from = std::exchange(at_, leg.path.back());
  if (rest == Rest::kSettled) prepare_exposure();
  wait_in_position(sent_s + 2 * leg.travel_s + settle + grace_s(cell_.clock, kGraceS));
  if (rest == Rest::kSettled && leg.path.size() == 1)
    motion_.add(description_, from, at_, idle_since_s_ - ordered_s - settle);
  rung_down_s_ = rest == Rest::kSettled ? 0 : cell_.clock.now_s() + leg.settle_s;
}

/// What the exposure at the end of the move needs, while the axes are under way.
void Run::prepare_exposure() {
  journal_.open_window_for(next_exposure_);
  const Exposure& exposure = program_.exposures[next_exposure_];
  cell_.laser.prepare(exposure.power_w, exposure.pulse_s);
}

void Run::follow(std::span<const Joints> path, Rest rest) {
  while (!path.empty()) {
    const auto count = waypoints_at_once(path);
    const Rest at_end = count == path.size() ? rest : Rest::kPassing;
    move(plan_leg(path.first(count), at_end, cell_.clock.now_s()), at_end);
    path = path.subspan(count);
  }
}

/// Woken by devices that learn by themselves of an arrival or a fault, else when the devices expect to
/// arrive.
void Run::wait_in_position(double deadline_s) {
  for (;;) {
    const double arrival_s = std::max(cell_.robot.expected_arrival_s(), cell_.table.expected_arrival_s());
    // After a stop was asked for, the axes have been stopped too: nothing to wait for.
    end_if_asked();
    if (arrival_s > cell_.clock.now_s()) cell_.clock.sleep_until(std::min(arrival_s, deadline_s));
    end_if_asked();
    const auto robot = cell_.robot.status();
    const auto table = cell_.table.status();
    check_under_way("robot", robot);
    check_under_way("table", table);
    if (cell_.laser.status().is_emitting) throw DriverError("the laser emits while the axes move");
    const bool is_robot_there = robot.in_position && is_near(robot.positions, *robot_target_);
    const bool is_table_there = table.in_position && is_near(table.positions, *table_target_);
    const double now_s = cell_.clock.now_s();
    if (is_robot_there && is_table_there) {
      const double known_s = std::max(robot.in_position_since_s, table.in_position_since_s);
      const bool is_known =
          robot.in_position_since_s > 0 && table.in_position_since_s > 0 && known_s <= now_s;
      idle_since_s_ = is_known ? std::max(known_s, idle_since_s_) : now_s;
      return;
    }
    if (now_s >= deadline_s) {
      const bool is_stray = is_robot_there ? table.in_position : robot.in_position;
      throw DriverError(std::string("the ") + (is_robot_there ? "table" : "robot") +
                        (is_stray ? " says that it is in position but stands elsewhere"
                                  : " is not in position long after its move should have ended"));
    }
    if (arrival_s <= now_s) cell_.clock.sleep_until(now_s + description_.timing.tick_s);
  }
}

void Run::travel_all(const std::vector<Joints>& path) {
  check_axes_ready();
  for (const Joints& target : path) check_pose(description_, target, 0);
  follow(path, Rest::kPassing);
}

/// The waypoints before exposure i that have not been passed yet.
std::span<const Via> Run::vias_of(std::size_t i) {
  const std::size_t first = next_via_;
  while (next_via_ < program_.vias.size() && program_.vias[next_via_].before_exposure <= i) ++next_via_;
  return std::span(program_.vias).subspan(first, next_via_ - first);
}

/// Until the status of both chains is recent enough.
void Run::wait_for_fresh_status() {
  const double begun_s = cell_.clock.now_s();
  const double since_s = begun_s - grace_s(cell_.clock, kStatusAgeMaxS, kStatusAgeMaxWallS);
  const auto is_fresh = [since_s](double read_s) { return read_s == 0 || read_s >= since_s; };
  for (;;) {
    const bool is_robot_fresh = is_fresh(cell_.robot.status().read_s);
    if (is_robot_fresh && is_fresh(cell_.table.status().read_s)) return;
    const double now_s = cell_.clock.now_s();
    if (now_s > begun_s + grace_s(cell_.clock, kGraceS))
      throw DriverError(std::string("the ") + (is_robot_fresh ? "table" : "robot") +
                        " has sent no status for too long");
    cell_.clock.sleep_until(now_s + description_.timing.tick_s);
  }
}

/// By measure: a controller that times the pulse in its queue of motions may call itself busy.
void Run::check_in_place(const char* when) {
  const auto robot = cell_.robot.status();
  const auto table = cell_.table.status();
  check_under_way("robot", robot);
  check_under_way("table", table);
  if (!is_near(robot.positions, *robot_target_))
    throw DriverError(std::string("the robot left its position ") + when + " a pulse");
  if (!is_near(table.positions, *table_target_))
    throw DriverError(std::string("the table left its position ") + when + " a pulse");
}

/// When a condition of the pulse is lost, the laser is turned off at once, whichever device gates it: a robot
/// in alarm may have forgotten when the pulse was to end.
void Run::check_pulse_conditions(const Laser::Status& laser) {
  if (!laser.interlock_closed) throw DriverError("the interlock was opened during a pulse");
  check_in_place("during");
}

/// The device times the pulse; this only waits for its end, woken by every change of a device.
void Run::wait_pulse_end(double fired_s, const Exposure& exposure) {
  const double end_s = cell_.clock.now_s() + exposure.pulse_s;
  const double deadline_s = end_s + grace_s(cell_.clock, kPulseGraceS);
  while (!control_.stop.load()) {
    const auto laser = cell_.laser.status();
    const double now_s = cell_.clock.now_s();
    const bool is_seen_over = laser.dark_since_s > fired_s;
    if (!laser.is_emitting && (is_seen_over || now_s >= end_s)) {
      idle_since_s_ = is_seen_over ? std::min(laser.dark_since_s, now_s) : now_s;
      return;
    }
    check_pulse_conditions(laser);
    // Once the gate is known to be off there is time: some lasers take long to report how the pulse was.
    const double reading_s = is_seen_over ? grace_s(cell_.clock, 0, kReadingWallS) : 0;
    if (now_s >= deadline_s + reading_s)
      throw DriverError("the laser still emits long after its pulse should have ended");
    cell_.clock.sleep_until(now_s < end_s ? end_s : now_s + description_.timing.tick_s);
  }
}

/// The first target ahead of a chain that is not where it was sent last, before or at exposure `next`.
template <std::size_t N>
void Run::prepare_chain(AxisGroup<N>& chain, const typename AxisGroup<N>::Positions& sent, std::size_t next) {
  const auto prepare = [&](const Joints& target) {
    if (chain_part<N>(target) == sent) return false;
    if (is_within_limits(description_, target)) chain.prepare(chain_part<N>(target));
    return true;
  };
  for (std::size_t v = next_via_; v < program_.vias.size() && program_.vias[v].before_exposure <= next; ++v)
    if (prepare(program_.vias[v].joints)) return;
  prepare(program_.exposures[next].joints);
}

/// While the pulse is on nothing moves, but the next targets can be sent already. Hints only: the move itself
/// reports what is wrong with them.
void Run::prepare_next(std::size_t i) {
  if (i + 1 >= program_.exposures.size() || journal_.state(i + 1) != ExposureState::kRemaining) return;
  try {
    prepare_chain(cell_.robot, *robot_target_, i + 1);
    prepare_chain(cell_.table, *table_target_, i + 1);
  } catch (const DriverError&) {  // the move that follows will meet the same device
  }
}

void Run::expose(std::size_t i) {
  const Exposure& exposure = program_.exposures[i];
  check_laser_ready();
  wait_for_fresh_status();
  check_in_place("before");
  end_if_asked_or_paused();

  journal_.arm(i);
  try {
    count_own_time();
    own_time_.add(std::exchange(own_s_, 0));
    is_off_verified_ = false;
    const double fired_s = cell_.clock.now_s();
    cell_.laser.fire(exposure.power_w, exposure.pulse_s);
    prepare_next(i);
    wait_pulse_end(fired_s, exposure);
    verify_laser_off();
    // A stop sets the flag before it cuts the pulse, so a flag that is still clear here means that the pulse
    // was whole.
    end_if_asked();
    // The device that gates the laser may have failed and cut the pulse, and an axis may have left its
    // position unseen.
    wait_for_fresh_status();
    const auto after = cell_.laser.status();
    check_pulse_conditions(after);
    if (after.state != DeviceState::kReady)
      throw DriverError(std::string("the laser went to state ") + device_state_name(after.state) +
                        " during a pulse" + (after.fault.empty() ? "" : ": " + after.fault));
  } catch (...) {
    cell_.laser.off();
    journal_.mark_in_doubt(i);
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
  vias_of(first);  // passed over: the approach replaces them

  for (std::size_t i = first; i < count; ++i) {
    end_if_asked_or_paused();
    const bool is_exposed = journal_.state(i) == ExposureState::kRemaining;
    if (is_exposed) check_pulse(laser_limits_, program_.exposures[i], i);
    path_.clear();
    if (i == first) path_ = approach;
    for (const Via& via : vias_of(i)) path_.push_back(via.joints);
    path_.push_back(program_.exposures[i].joints);
    for (const Joints& target : path_) check_pose(description_, target, i);
    next_exposure_ = i;
    follow(path_, is_exposed ? Rest::kSettled : Rest::kPassing);
    if (!is_exposed) continue;
    expose(i);
    if (progress) progress(journal_.done_count());
  }
  path_.clear();
  for (const Via& via : vias_of(count)) path_.push_back(via.joints);
  for (const Joints& target : path_) check_pose(description_, target, count);
  follow(path_, Rest::kPassing);  // the path home
}

/// The laser first, then motion; each, whatever the others answer.
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
    // A device that refuses because it was just stopped is not at fault.
    result.outcome = control.stop.load() ? ExecutionOutcome::kStopped : ExecutionOutcome::kFailed;
    result.reason = error.what();
  } catch (...) {
    make_safe(cell);
    result.outcome = ExecutionOutcome::kFailed;
    result.reason = "an unknown exception was thrown";
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
  result.own_time = run.own_time();
  result.motion = run.motion();
  return result;
}

ExecutionResult travel(const std::vector<Joints>& path, const Cell& cell, const CellDescription& description,
                       ExecutionControl& control) {
  const ExposureProgram no_program;
  Journal no_journal = Journal::in_memory(0);
  Run run(no_program, cell, description, no_journal, control);
  return run_guarded(cell, control, [&] { run.travel_all(path); });
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
