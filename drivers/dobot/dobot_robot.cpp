#include "drivers/dobot/dobot_robot.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "drivers/dobot/dobot_gate.h"
#include "drivers/driver_error.h"
#include "drivers/number_text.h"

namespace hilbrush {
namespace {

constexpr double kFrameS = 0.008;
constexpr double kSilentFrames = 30;   ///< this many missing in a row: the feedback has stopped
constexpr double kSilenceMinS = 0.25;  ///< wall: a busy machine may keep the reader waiting
constexpr double kEnableS = 20;        ///< cell
constexpr double kSetpointWindow =
    2e-5;                           ///< deg, mm: what six decimals and the controller's arithmetic may differ
constexpr double kRestSpeed = 0.5;  ///< deg/s, mm/s
constexpr double kStampMs = 1;      ///< resolution of the frames' time stamps
constexpr std::size_t kJ3Index = 2;

double window_of(const DobotOptions& options, std::size_t joint) {
  return joint == kJ3Index ? options.window_m * 1e3 : options.window_rad * 180 / std::numbers::pi;
}

std::array<AxisBounds, 4> scaled_bounds(const DobotOptions& options) {
  std::array<AxisBounds, 4> bounds = options.bounds;
  for (AxisBounds& axis : bounds) axis.speed_max = axis.speed_max * options.speed_percent / 100;
  return bounds;
}

std::array<AxisLabel, 4> joint_labels() {
  constexpr double kDegreesPerRad = 180 / std::numbers::pi;
  return {{{"j1", kDegreesPerRad, "degrees"},
           {"j2", kDegreesPerRad, "degrees"},
           {"j3", 1e3, "mm"},
           {"j4", kDegreesPerRad, "degrees"}}};
}

}  // namespace

DobotRobot::DobotRobot(const DobotOptions& options, Clock& clock)
    : options_(options),
      clock_(clock),
      group_(mutex_, "robot", scaled_bounds(options), joint_labels()),
      ports_(options, std::max(kSilenceMinS, clock.wall_s(kSilentFrames * kFrameS))) {}

DobotRobot::~DobotRobot() {
  ports_.close();
}

DobotRobot::Positions DobotRobot::to_si(const dobot::Joints& joints) const {
  Positions positions;
  for (std::size_t i = 0; i < positions.size(); ++i) positions[i] = options_.scales[i].to_si(joints[i]);
  return positions;
}

/// Under the lock. True if it is news.
bool DobotRobot::set_fault(const std::string& sentence) {
  if (!group_.set_fault(sentence)) return false;
  for (const auto& [output, gate] : gates_) gate->forget();
  return true;
}

void DobotRobot::fail(const std::string& sentence) {
  {
    const std::lock_guard lock(mutex_);
    if (!set_fault(sentence)) return;
  }
  close_gates();
  clock_.wake();
}

/// After a fault it is not known whether the controller still carries out what was queued, such as the end of
/// a pulse. The dashboard may still answer.
void DobotRobot::close_gates() noexcept {
  std::vector<OutputGate*> gates;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [output, gate] : gates_) gates.push_back(gate.get());
  }
  for (OutputGate* gate : gates) gate->off();
}

void DobotRobot::connect() {
  group_.require(DeviceState::kDisconnected, "connected");
  ports_.dashboard(dobot::encode("RobotMode"));
  {
    const std::lock_guard lock(mutex_);
    frame_count_ = 0;
    group_.fault.clear();
    group_.is_target_current = group_.is_in_position = false;
  }
  ports_.open({[this](const dobot::Frame& frame) { take_frame(frame); },
               [this](const std::string& sentence) { fail(sentence); }});
  {
    const std::lock_guard lock(mutex_);
    group_.state = DeviceState::kConnected;
  }
  try {
    const double deadline_s = clock_.now_s() + 2;
    for (;;) {
      {
        const std::lock_guard lock(mutex_);
        if (frame_count_ > 0) {
          if (group_.state == DeviceState::kFault) group_.refuse("connected");  // it is, and can be cleared
          return;
        }
        if (group_.state == DeviceState::kFault) throw LinkError(group_.fault);
      }
      if (clock_.now_s() > deadline_s) throw LinkError("the robot sends no feedback");
      clock_.sleep_until(clock_.now_s() + kFrameS);
    }
  } catch (const LinkError&) {
    ports_.close();
    const std::lock_guard lock(mutex_);
    group_.state = DeviceState::kDisconnected;
    throw;
  }
}

void DobotRobot::wait_for_mode(dobot::Mode mode, double cell_s, const char* participle) {
  const double deadline_s = clock_.now_s() + cell_s;
  for (;;) {
    {
      const std::lock_guard lock(mutex_);
      if (group_.state == DeviceState::kFault) group_.refuse(participle);
      if (frame_.mode == mode) return;
      if (clock_.now_s() > deadline_s)
        throw DriverError(std::string("the robot cannot be ") + participle + ": it is " +
                          dobot::mode_name(frame_.mode));
    }
    clock_.sleep_until(clock_.now_s() + kFrameS);
  }
}

void DobotRobot::enable() {
  group_.require(DeviceState::kConnected, "enabled");
  ports_.dashboard(dobot::encode("EnableRobot"), DobotPorts::kReplyS * 5);
  wait_for_mode(dobot::Mode::kEnabled, kEnableS, "enabled");
  ports_.dashboard(
      dobot::encode("ResetRobot"));  // a queue left behind by another program must not start to move
  ports_.dashboard(dobot::encode("SpeedFactor", {options_.speed_percent}));
  ports_.dashboard(dobot::encode("User", {0}));
  ports_.dashboard(dobot::encode("Tool", {0}));
  ports_.dashboard(dobot::encode("CP", {0}));  // no blending: each target is reached
  const std::lock_guard lock(mutex_);
  if (group_.state != DeviceState::kConnected) group_.refuse("enabled");
  group_.state = DeviceState::kEnabled;
}

void DobotRobot::home() {
  const std::lock_guard lock(mutex_);
  if (group_.state != DeviceState::kEnabled) group_.refuse("homed");
  group_.state = DeviceState::kReady;
}

void DobotRobot::disable() noexcept {
  {
    const std::lock_guard lock(mutex_);
    if (group_.state == DeviceState::kDisconnected) return;
  }
  stop();
  try {
    ports_.dashboard(dobot::encode("DisableRobot"), DobotPorts::kUrgentS);
  } catch (const std::exception&) {
    // It may be powered off already; the frames say what it is.
  }
  const std::lock_guard lock(mutex_);
  if (group_.state != DeviceState::kFault) group_.state = DeviceState::kConnected;
}

/// Closes gates whose pulse is not over: emptying the queue drops the end of the pulse as well.
void DobotRobot::end_pulses() noexcept {
  std::vector<OutputGate*> gates;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [output, gate] : gates_)
      if (gate->is_pulsing()) gates.push_back(gate.get());
  }
  for (OutputGate* gate : gates) gate->off();
}

void DobotRobot::wait_for_alarm_end() {
  const std::string alarm = std::to_string(static_cast<int>(dobot::Mode::kError));
  const double deadline_s = clock_.now_s() + 2;
  while (ports_.dashboard(dobot::encode("RobotMode")) == alarm) {
    if (clock_.now_s() > deadline_s)
      throw DriverError("the robot stays in alarm: " + ports_.dashboard(dobot::encode("GetErrorID")));
    clock_.sleep_until(clock_.now_s() + kFrameS);
  }
}

/// Connects all ports again: after a fault it is not known which answers are still to come.
void DobotRobot::clear_fault() {
  group_.require(DeviceState::kFault, "cleared of a fault");
  ports_.close();
  {
    const std::lock_guard lock(mutex_);
    group_.state = DeviceState::kDisconnected;
  }
  try {
    ports_.dashboard(dobot::encode("ResetRobot"));
    ports_.dashboard(dobot::encode("ClearError"));
    ports_.dashboard(dobot::encode("continue"));
    wait_for_alarm_end();
    connect();
  } catch (const DriverError& error) {
    const std::lock_guard lock(mutex_);
    group_.state = DeviceState::kFault;
    group_.fault = error.what();
    throw;
  }
}

double DobotRobot::travel_s(const dobot::Joints& from, const dobot::Joints& to) const {
  Positions distances;
  for (std::size_t i = 0; i < from.size(); ++i)
    distances[i] = std::abs(to[i] - from[i]) / options_.scales[i].steps_per_unit;
  return group_.travel_s(distances);
}

void DobotRobot::move_to(const Positions& target, double settle_s) {
  group_.check_settle_time(settle_s);
  group_.check_bounds(target);
  dobot::Joints joints;
  for (std::size_t i = 0; i < joints.size(); ++i) joints[i] = options_.scales[i].to_device(target[i]);
  {
    const std::lock_guard lock(mutex_);
    if (group_.state != DeviceState::kReady) group_.refuse("moved");
    for (const auto& [output, gate] : gates_)
      if (gate->is_pulsing()) throw DriverError("the robot refuses to move: a pulse is not over");
    if (!group_.is_under_way()) queued_ = 0;
    if (queued_ > kLookAhead) throw DriverError("the robot refuses to move: too many targets are ahead");
    ++queued_;
    const double start_s =
        std::max(clock_.now_s(), group_.is_under_way() ? group_.arrival_s - group_.settle_s : 0);
    group_.arrival_s =
        start_s + travel_s(group_.is_target_current ? target_ : frame_.actual, joints) + settle_s;
    target_ = joints;
    group_.settle_s = settle_s;
    group_.is_target_current = true;
    group_.is_in_position = false;
    rest_ms_ = -1;
    accepted_ms_ = frame_.time_ms;
  }
  const std::string command = dobot::encode_joint_move(joints);
  try {
    ports_.motion(&command, 1);
  } catch (const DriverError&) {
    const std::lock_guard lock(mutex_);
    group_.is_target_current = false;
    throw;
  }
  const std::lock_guard lock(mutex_);
  accepted_ms_ = std::max(accepted_ms_, frame_.time_ms);
  rest_ms_ = -1;
  group_.is_in_position = false;
}

/// By what the controller reports: its profile has ended at the target, no axis moves, nothing is queued.
bool DobotRobot::is_at_rest(const dobot::Frame& frame) const {
  // While the queue times a pulse the controller reports "running" although the arm, already in position,
  // does not move. Before that, "running" counts as motion: a frame may show the very beginning of a move,
  // still at speed 0.
  const bool is_pulsing_in_place =
      group_.is_in_position &&
      std::any_of(gates_.begin(), gates_.end(), [](const auto& gate) { return gate.second->is_busy(); });
  if (!is_pulsing_in_place && (frame.mode != dobot::Mode::kEnabled || frame.is_running)) return false;
  for (std::size_t i = 0; i < target_.size(); ++i)
    if (!(std::abs(frame.setpoint[i] - target_[i]) <= kSetpointWindow) ||
        !(std::abs(frame.speed[i]) <= kRestSpeed))
      return false;
  return true;
}

bool DobotRobot::is_within_window(const dobot::Frame& frame) const {
  for (std::size_t i = 0; i < target_.size(); ++i)
    if (!(std::abs(frame.actual[i] - target_[i]) <= window_of(options_, i))) return false;
  return true;
}

/// Under the lock. True if in_position changed. Settling is counted from the first frame that shows rest,
/// although the profile ended up to a frame earlier: what happened between two frames is not known, and a
/// pulse must not be early.
bool DobotRobot::judge_arrival(const dobot::Frame& frame) {
  const bool was_in_position = group_.is_in_position;
  if (!group_.is_target_current || frame.time_ms <= accepted_ms_ || !is_at_rest(frame)) {
    rest_ms_ = -1;
    group_.is_in_position = false;
    return was_in_position;
  }
  const double time_ms = static_cast<double>(frame.time_ms);
  const bool is_near = is_within_window(frame);
  // Stamps are cut to whole milliseconds: one is added, so that the settle time is never cut short.
  if (rest_ms_ < 0) rest_ms_ = time_ms + kStampMs;
  if (was_in_position && !is_near) rest_ms_ = time_ms + kStampMs;  // it left its place: settling starts again
  group_.is_in_position = is_near && (group_.settle_s <= 0 || time_ms >= rest_ms_ + group_.settle_s * 1e3);
  if (group_.is_in_position && !was_in_position) group_.in_position_since_s = clock_.now_s();
  return group_.is_in_position != was_in_position;
}

/// Reader's thread.
void DobotRobot::take_frame(const dobot::Frame& frame) {
  bool is_news = false;
  bool has_failed = false;
  {
    const std::lock_guard lock(mutex_);
    if (frame_count_ > 0 && frame.time_ms == frame_.time_ms) return;  // stale
    ++frame_count_;
    frame_ = frame;
    frame_s_ = clock_.now_s();
    const bool is_on = group_.state == DeviceState::kEnabled || group_.state == DeviceState::kReady;
    const bool is_alive = is_on || group_.state == DeviceState::kConnected;
    if (is_alive && (frame.mode == dobot::Mode::kError || frame.has_error))
      is_news = set_fault("the robot is in alarm");
    else if (is_on && frame.mode != dobot::Mode::kEnabled && frame.mode != dobot::Mode::kRunning)
      is_news = set_fault(std::string("the robot is ") + dobot::mode_name(frame.mode));
    else if (group_.state != DeviceState::kFault)
      is_news = judge_arrival(frame);
    for (const auto& [output, gate] : gates_)
      if (const char* fault = gate->fault_in(frame)) {
        has_failed = true;
        gate->forget();
        is_news = set_fault("the robot's output " + std::to_string(output) + " " + fault);
      }
    has_failed = has_failed || (is_news && group_.state == DeviceState::kFault);
  }
  if (has_failed) close_gates();
  if (is_news) clock_.wake();
}

DobotRobot::Status DobotRobot::status() {
  const std::lock_guard lock(mutex_);
  return group_.status(to_si(frame_.actual), frame_s_);
}

double DobotRobot::expected_arrival_s() {
  const std::lock_guard lock(mutex_);
  return group_.expected_arrival_s(clock_.now_s());
}

void DobotRobot::stop() noexcept {
  try {
    {
      const std::lock_guard lock(mutex_);
      if (group_.state == DeviceState::kDisconnected || group_.state == DeviceState::kConnected) return;
      group_.is_target_current = group_.is_in_position = false;
    }
    end_pulses();
    ports_.dashboard(dobot::encode("ResetRobot"), DobotPorts::kUrgentS);
    ports_.forget_owed();
  } catch (const std::exception& error) {
    fail(std::string("the robot does not confirm a stop: ") + error.what());
  }
  clock_.wake();
}

Gate& DobotRobot::gate(int output) {
  const std::lock_guard lock(mutex_);
  auto& gate = gates_[output];
  if (!gate) gate = std::make_unique<OutputGate>(*this, output);
  return *gate;
}

std::vector<std::string> DobotRobot::identify() {
  std::vector<std::string> lines;
  lines.push_back("Dobot 4-axis controller at " + options_.host);
  const std::string errors = ports_.dashboard(dobot::encode("GetErrorID"));
  const std::lock_guard lock(mutex_);
  lines.push_back(std::string("robot is ") + dobot::mode_name(frame_.mode));
  lines.push_back("alarms: " + errors);
  const auto joint = [this](std::size_t i) { return fixed_text(frame_.actual[i], 4); };
  lines.push_back("joints " + joint(0) + ", " + joint(1) + " deg, " + joint(2) + " mm, " + joint(3) + " deg");
  return lines;
}

}  // namespace hilbrush
