#include "drivers/dobot/dobot_robot.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "drivers/dobot/dobot_gate.h"
#include "drivers/driver_error.h"

namespace hilbrush {
namespace {

constexpr double kFrameS = 0.008;
constexpr double kSilentFrames = 30;      ///< so many missing in a row: the feedback has stopped
constexpr double kSilenceMinS = 0.25;     ///< wall: a busy machine may keep the reader waiting
constexpr double kEnableS = 20;           ///< cell
constexpr double kSetpointWindow = 2e-5;  ///< deg, mm: what six decimals and the controller's arithmetic may differ
constexpr double kRestSpeed = 0.5;        ///< deg/s, mm/s
constexpr double kStampMs = 1;            ///< resolution of the frames' time stamps
constexpr std::size_t kJ3Index = 2;

double window_of(const DobotOptions& options, std::size_t joint) {
  return joint == kJ3Index ? options.window_m * 1e3 : options.window_rad * 180 / std::numbers::pi;
}

}  // namespace

DobotRobot::DobotRobot(const DobotOptions& options, Clock& clock)
    : options_(options),
      clock_(clock),
      ports_(options, std::max(kSilenceMinS, clock.wall_s(kSilentFrames * kFrameS))) {}

DobotRobot::~DobotRobot() {
  ports_.close();
}

DobotRobot::Positions DobotRobot::ours(const DobotJoints& joints) const {
  Positions positions;
  for (std::size_t i = 0; i < positions.size(); ++i) positions[i] = options_.scales[i].to_si(joints[i]);
  return positions;
}

void DobotRobot::refuse(const char* participle) const {
  const std::string is = state_ == DeviceState::kFault ? "it reports a fault: " + fault_
                                                       : std::string("it is ") + device_state_name(state_);
  throw DriverError(std::string("the robot cannot be ") + participle + ": " + is);
}

void DobotRobot::require(DeviceState state, const char* participle) {
  const std::lock_guard lock(mutex_);
  if (state_ != state) refuse(participle);
}

/// Under the lock. True if it is news.
bool DobotRobot::set_fault(const std::string& sentence) {
  is_in_position_ = is_target_current_ = false;
  if (state_ == DeviceState::kFault || state_ == DeviceState::kDisconnected) return false;
  state_ = DeviceState::kFault;
  fault_ = sentence;
  for (const auto& [output, gate] : gates_) gate->forget();
  return true;
}

void DobotRobot::fail(const std::string& sentence) {
  {
    const std::lock_guard lock(mutex_);
    if (!set_fault(sentence)) return;
  }
  shut_gates();
  clock_.wake();
}

/// After a fault nobody knows whether the controller still carries out what was queued, such as the end of a pulse: the
/// dashboard may answer all the same.
void DobotRobot::shut_gates() noexcept {
  std::vector<OutputGate*> gates;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [output, gate] : gates_) gates.push_back(gate.get());
  }
  for (OutputGate* gate : gates) gate->off();
}

void DobotRobot::connect() {
  require(DeviceState::kDisconnected, "connected");
  ports_.dashboard(encode_dobot("RobotMode"));
  {
    const std::lock_guard lock(mutex_);
    frame_count_ = 0;
    fault_.clear();
    is_target_current_ = is_in_position_ = false;
  }
  ports_.open({[this](const DobotFrame& frame) { take_frame(frame); },
               [this](const std::string& sentence) { fail(sentence); }});
  {
    const std::lock_guard lock(mutex_);
    state_ = DeviceState::kConnected;
  }
  try {
    const double deadline_s = clock_.now_s() + 2;
    for (;;) {
      {
        const std::lock_guard lock(mutex_);
        if (frame_count_ > 0) {
          if (state_ == DeviceState::kFault) refuse("connected");  // it is, and can be cleared
          return;
        }
        if (state_ == DeviceState::kFault) throw LinkError(fault_);
      }
      if (clock_.now_s() > deadline_s) throw LinkError("the robot sends no feedback");
      clock_.sleep_until(clock_.now_s() + kFrameS);
    }
  } catch (const LinkError&) {
    ports_.close();
    const std::lock_guard lock(mutex_);
    state_ = DeviceState::kDisconnected;
    throw;
  }
}

void DobotRobot::wait_for_mode(DobotMode mode, double cell_s, const char* participle) {
  const double deadline_s = clock_.now_s() + cell_s;
  for (;;) {
    {
      const std::lock_guard lock(mutex_);
      if (state_ == DeviceState::kFault) refuse(participle);
      if (frame_.mode == mode) return;
      if (clock_.now_s() > deadline_s)
        throw DriverError(std::string("the robot cannot be ") + participle + ": it is " + dobot_mode_name(frame_.mode));
    }
    clock_.sleep_until(clock_.now_s() + kFrameS);
  }
}

void DobotRobot::enable() {
  require(DeviceState::kConnected, "enabled");
  ports_.dashboard(encode_dobot("EnableRobot"), DobotPorts::kReplyS * 5);
  wait_for_mode(DobotMode::kEnabled, kEnableS, "enabled");
  ports_.dashboard(encode_dobot("ResetRobot"));  // a queue that another program left behind must not start to move
  ports_.dashboard(encode_dobot("SpeedFactor", {options_.speed_percent}));
  ports_.dashboard(encode_dobot("User", {0}));
  ports_.dashboard(encode_dobot("Tool", {0}));
  ports_.dashboard(encode_dobot("CP", {0}));  // no blending: each target is reached
  const std::lock_guard lock(mutex_);
  if (state_ != DeviceState::kConnected) refuse("enabled");
  state_ = DeviceState::kEnabled;
}

void DobotRobot::home() {
  const std::lock_guard lock(mutex_);
  if (state_ != DeviceState::kEnabled) refuse("homed");
  state_ = DeviceState::kReady;
}

void DobotRobot::disable() noexcept {
  {
    const std::lock_guard lock(mutex_);
    if (state_ == DeviceState::kDisconnected) return;
  }
  stop();
  try {
    ports_.dashboard(encode_dobot("DisableRobot"), DobotPorts::kUrgentS);
  } catch (const std::exception&) {
    // It may be powered off already; the frames say what it is.
  }
  const std::lock_guard lock(mutex_);
  if (state_ != DeviceState::kFault) state_ = DeviceState::kConnected;
}

/// Emptying the queue drops the end of a pulse with the rest.
void DobotRobot::shut_pulses() noexcept {
  std::vector<OutputGate*> gates;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [output, gate] : gates_)
      if (gate->is_pulsing()) gates.push_back(gate.get());
  }
  for (OutputGate* gate : gates) gate->off();
}

void DobotRobot::wait_for_alarm_end() {
  const std::string alarm = std::to_string(static_cast<int>(DobotMode::kError));
  const double deadline_s = clock_.now_s() + 2;
  while (ports_.dashboard(encode_dobot("RobotMode")) == alarm) {
    if (clock_.now_s() > deadline_s)
      throw DriverError("the robot stays in alarm: " + ports_.dashboard(encode_dobot("GetErrorID")));
    clock_.sleep_until(clock_.now_s() + kFrameS);
  }
}

/// Everything is connected anew: after a fault it is not known what the ports still owe.
void DobotRobot::clear_fault() {
  require(DeviceState::kFault, "cleared of a fault");
  ports_.close();
  {
    const std::lock_guard lock(mutex_);
    state_ = DeviceState::kDisconnected;
  }
  try {
    ports_.dashboard(encode_dobot("ResetRobot"));
    ports_.dashboard(encode_dobot("ClearError"));
    ports_.dashboard(encode_dobot("continue"));
    wait_for_alarm_end();
    connect();
  } catch (const DriverError& error) {
    const std::lock_guard lock(mutex_);
    state_ = DeviceState::kFault;
    fault_ = error.what();
    throw;
  }
}

void DobotRobot::check_bounds(const Positions& target) const {
  for (std::size_t i = 0; i < target.size(); ++i) {
    const AxisBounds& bounds = options_.bounds[i];
    if (target[i] >= bounds.min - kBoundsTolerance && target[i] <= bounds.max + kBoundsTolerance) continue;
    const double factor = i == kJ3Index ? 1e3 : 180 / std::numbers::pi;
    char text[160];
    std::snprintf(text, sizeof text, "the robot refuses to move joint %zu to %.4f %s: its limits are %.4f to %.4f",
                  i + 1, target[i] * factor, i == kJ3Index ? "mm" : "degrees", bounds.min * factor,
                  bounds.max * factor);
    throw DriverError(text);
  }
}

/// Trapezoidal profiles at the cell file's limits; only a hint for whoever waits.
double DobotRobot::travel_s(const DobotJoints& from, const DobotJoints& to) const {
  double longest_s = 0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const AxisBounds& bounds = options_.bounds[i];
    const double way = std::abs(to[i] - from[i]) / options_.scales[i].steps_per_unit;
    const double speed = bounds.speed_max * options_.speed_percent / 100, rate = bounds.acceleration_max;
    if (!(speed > 0) || !(rate > 0)) continue;
    const double seconds = way * rate < speed * speed ? 2 * std::sqrt(way / rate) : way / speed + speed / rate;
    longest_s = std::max(longest_s, seconds);
  }
  return longest_s;
}

void DobotRobot::move_to(const Positions& target, double settle_s) {
  if (!(settle_s >= 0) || settle_s > kMaxSettleS) throw DriverError("the robot refuses a settle time that is no time");
  check_bounds(target);
  DobotJoints joints;
  for (std::size_t i = 0; i < joints.size(); ++i) joints[i] = options_.scales[i].to_device(target[i]);
  {
    const std::lock_guard lock(mutex_);
    if (state_ != DeviceState::kReady) refuse("moved");
    for (const auto& [output, gate] : gates_)
      if (gate->is_pulsing()) throw DriverError("the robot refuses to move: a pulse is not over");
    if (!is_target_current_ || is_in_position_) queued_ = 0;
    if (queued_ > kLookAhead) throw DriverError("the robot refuses to move: too many targets are ahead");
    ++queued_;
    const double start_s =
        std::max(clock_.now_s(), is_target_current_ && !is_in_position_ ? arrival_s_ - settle_s_ : 0);
    arrival_s_ = start_s + travel_s(is_target_current_ ? target_ : frame_.actual, joints) + settle_s;
    target_ = joints;
    settle_s_ = settle_s;
    is_target_current_ = true;
    is_in_position_ = false;
    rest_ms_ = -1;
    accepted_ms_ = frame_.time_ms;
  }
  const std::string command = encode_dobot_joint_move(joints);
  try {
    ports_.motion(&command, 1);
  } catch (const DriverError&) {
    const std::lock_guard lock(mutex_);
    is_target_current_ = false;
    throw;
  }
  const std::lock_guard lock(mutex_);
  accepted_ms_ = std::max(accepted_ms_, frame_.time_ms);
  rest_ms_ = -1;
  is_in_position_ = false;
}

/// The controller's own account: its profile has ended at the target, nothing turns, nothing is queued.
bool DobotRobot::is_at_rest(const DobotFrame& frame) const {
  // While the queue times a pulse the controller calls itself running; that is no motion where the arm stood already.
  // Before, running is believed: a frame may show the very begin of a move, at no speed yet, and the next one its end.
  const bool is_pulsing_in_place = is_in_position_ && std::any_of(gates_.begin(), gates_.end(), [](const auto& gate) {
                                     return gate.second->is_busy();
                                   });
  if (!is_pulsing_in_place && (frame.mode != DobotMode::kEnabled || frame.is_running)) return false;
  for (std::size_t i = 0; i < target_.size(); ++i)
    if (!(std::abs(frame.setpoint[i] - target_[i]) <= kSetpointWindow) || !(std::abs(frame.speed[i]) <= kRestSpeed))
      return false;
  return true;
}

bool DobotRobot::is_within_window(const DobotFrame& frame) const {
  for (std::size_t i = 0; i < target_.size(); ++i)
    if (!(std::abs(frame.actual[i] - target_[i]) <= window_of(options_, i))) return false;
  return true;
}

/// Under the lock. True if in_position changed. Settling is counted from the first frame that shows rest, although the
/// profile ended up to a frame earlier: what happened between two frames is not known, and a pulse must not be early.
bool DobotRobot::judge_arrival(const DobotFrame& frame) {
  const bool was_in_position = is_in_position_;
  if (!is_target_current_ || frame.time_ms <= accepted_ms_ || !is_at_rest(frame)) {
    rest_ms_ = -1;
    is_in_position_ = false;
    return was_in_position;
  }
  const double time_ms = static_cast<double>(frame.time_ms);
  const bool is_near = is_within_window(frame);
  // Stamps are cut to whole milliseconds: one is added, so that the settle time is never cut short.
  if (rest_ms_ < 0) rest_ms_ = time_ms + kStampMs;
  if (was_in_position && !is_near) rest_ms_ = time_ms + kStampMs;  // it left its place: settling begins anew
  is_in_position_ = is_near && (settle_s_ <= 0 || time_ms >= rest_ms_ + settle_s_ * 1e3);
  if (is_in_position_ && !was_in_position) in_position_since_s_ = clock_.now_s();
  return is_in_position_ != was_in_position;
}

/// Reader's thread.
void DobotRobot::take_frame(const DobotFrame& frame) {
  bool is_news = false, has_failed = false;
  {
    const std::lock_guard lock(mutex_);
    if (frame_count_ > 0 && frame.time_ms == frame_.time_ms) return;  // stale
    ++frame_count_;
    frame_ = frame;
    frame_s_ = clock_.now_s();
    const bool is_on = state_ == DeviceState::kEnabled || state_ == DeviceState::kReady;
    const bool is_alive = is_on || state_ == DeviceState::kConnected;
    if (is_alive && (frame.mode == DobotMode::kError || frame.has_error))
      is_news = set_fault("the robot is in alarm");
    else if (is_on && frame.mode != DobotMode::kEnabled && frame.mode != DobotMode::kRunning)
      is_news = set_fault(std::string("the robot is ") + dobot_mode_name(frame.mode));
    else if (state_ != DeviceState::kFault)
      is_news = judge_arrival(frame);
    for (const auto& [output, gate] : gates_)
      if (const char* fault = gate->fault_in(frame)) {
        has_failed = true;
        gate->forget();
        is_news = set_fault("the robot's output " + std::to_string(output) + " " + fault);
      }
    has_failed = has_failed || (is_news && state_ == DeviceState::kFault);
  }
  if (has_failed) shut_gates();
  if (is_news) clock_.wake();
}

DobotRobot::Status DobotRobot::status() {
  const std::lock_guard lock(mutex_);
  Status status;
  const bool is_under_way = state_ == DeviceState::kReady && is_target_current_ && !is_in_position_;
  status.state = is_under_way ? DeviceState::kMoving : state_;
  status.positions = ours(frame_.actual);
  status.in_position = state_ == DeviceState::kReady && is_in_position_;
  status.fault = fault_;
  status.in_position_since_s = status.in_position ? in_position_since_s_ : 0;
  status.read_s = frame_s_;
  return status;
}

double DobotRobot::expected_arrival_s() {
  const std::lock_guard lock(mutex_);
  const double now_s = clock_.now_s();
  return is_target_current_ && !is_in_position_ ? std::max(now_s, arrival_s_) : now_s;
}

void DobotRobot::stop() noexcept {
  try {
    {
      const std::lock_guard lock(mutex_);
      if (state_ == DeviceState::kDisconnected || state_ == DeviceState::kConnected) return;
      is_target_current_ = is_in_position_ = false;
    }
    shut_pulses();
    ports_.dashboard(encode_dobot("ResetRobot"), DobotPorts::kUrgentS);
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
  const std::string errors = ports_.dashboard(encode_dobot("GetErrorID"));
  const std::lock_guard lock(mutex_);
  lines.push_back(std::string("robot is ") + dobot_mode_name(frame_.mode));
  lines.push_back("alarms: " + errors);
  char text[160];
  std::snprintf(text, sizeof text, "joints %.4f, %.4f deg, %.4f mm, %.4f deg", frame_.actual[0], frame_.actual[1],
                frame_.actual[2], frame_.actual[3]);
  lines.push_back(text);
  return lines;
}

}  // namespace hilbrush
