#include "sim/wire/dobot_controller.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include "sim/wire/read_number.h"

namespace hilbrush {
namespace {

constexpr int kOk = 0, kFailed = -1, kNoSuchCommand = -10000, kWrongCount = -20000, kWrongType = -30000,
              kOutOfRange = -40000;
constexpr int kOutputMax = 24;

std::string answered(int error, const std::string& values = {}) {
  return std::to_string(error) + ",{" + values + "},";
}

bool read_integer(const std::string& text, int& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

double to_wire(std::size_t axis, double value) {
  return axis == kJ3 ? value * 1e3 : value * 180 / std::numbers::pi;
}
double from_wire(std::size_t axis, double value) {
  return axis == kJ3 ? value * 1e-3 : value * std::numbers::pi / 180;
}

std::string listed(const std::array<double, 4>& values) {
  std::string text;
  for (const double value : values) text += fmt::format("{}{:.6f}", text.empty() ? "" : ",", value);
  return text;
}

/// x, y, z in mm and the flange's heading in degrees.
std::array<double, 4> pose_of(const CellDescription::Arm& arm, const std::array<double, 4>& joints) {
  const double elbow = joints[0] + joints[1];
  const double x = arm.upper_arm_m * std::cos(joints[0]) + arm.forearm_m * std::cos(elbow);
  const double y = arm.upper_arm_m * std::sin(joints[0]) + arm.forearm_m * std::sin(elbow);
  return {x * 1e3, y * 1e3, joints[2] * 1e3, (elbow + joints[3]) * 180 / std::numbers::pi};
}

/// The joints of a pose, the elbow on the side of `near`; nothing if it is out of reach.
std::optional<std::array<double, 4>> joints_of(const CellDescription::Arm& arm,
                                               const std::array<double, 4>& pose, double near_j2) {
  const double x = pose[0] * 1e-3;
  const double y = pose[1] * 1e-3;
  const double a = arm.upper_arm_m;
  const double b = arm.forearm_m;
  const double cosine = (x * x + y * y - a * a - b * b) / (2 * a * b);
  if (!(std::abs(cosine) <= 1)) return std::nullopt;
  const double j2 = std::copysign(std::acos(cosine), near_j2 == 0 ? 1 : near_j2);
  const double j1 = std::atan2(y, x) - std::atan2(b * std::sin(j2), a + b * std::cos(j2));
  return std::array<double, 4>{j1, j2, pose[2] * 1e-3, pose[3] * std::numbers::pi / 180 - j1 - j2};
}

}  // namespace

DobotController::DobotController(TrueCell& cell, FaultInjector& faults, TimeRecord& times,
                                 const DobotControllerOptions& options)
    : cell_(cell), faults_(faults), times_(times), options_(options) {
  last_ = present();
}

std::string DobotController::dashboard(const std::string& name, const Arguments& arguments) {
  if (name == "enablerobot") {
    if (alarm_ != 0) return answered(kFailed);
    if (!is_enabled_) enabled_s_ = cell_.now_s() + options_.enable_s;
    is_enabled_ = true;
    return answered(kOk);
  }
  if (name == "disablerobot") {
    reset();
    is_enabled_ = false;
    return answered(kOk);
  }
  if (name == "clearerror") {
    alarm_ = 0;
    return answered(kOk);
  }
  if (name == "emergencystop") {
    raise_alarm(1);
    return answered(kOk);
  }
  if (name == "resetrobot") return reset();
  if (name == "pause" || name == "continue") {
    is_paused_ = name == "pause";
    return answered(kOk);
  }
  if (name == "robotmode") return answered(kOk, std::to_string(frame().empty() ? 0 : last_.mode));
  if (name == "geterrorid") {
    const std::string id = alarm_ != 0 ? std::to_string(alarm_) : "";
    return answered(kOk, "[[" + id + "],[],[],[],[]]");
  }
  if (name == "getangle" || name == "getpose") {
    frame();
    std::array<double, 4> values{};
    for (std::size_t i = 0; i < 4; ++i) values[i] = to_wire(i, last_.positions[i]);
    return answered(kOk,
                    listed(name == "getangle" ? values : pose_of(cell_.description().arm, last_.positions)));
  }
  if (name == "speedfactor") return set_ratio(arguments, speed_factor_);
  if (name == "speedj") return set_ratio(arguments, joint_speed_);
  if (name == "accj") return set_ratio(arguments, joint_acceleration_);
  if (name == "doexecute" || name == "do") return output_command(arguments, false);
  if (name == "di") {
    int index = 0;
    if (arguments.size() != 1) return answered(kWrongCount);
    if (!read_integer(arguments[0], index)) return answered(kWrongType - 1);
    return answered(kOk, "0");
  }
  if (name == "user" || name == "tool" || name == "cp" || name == "payload" || name == "setcollisionlevel")
    return arguments.empty() ? answered(kWrongCount) : answered(kOk);
  return answered(kNoSuchCommand);
}

std::string DobotController::motion(const std::string& name, const Arguments& arguments) {
  if (name == "jointmovj") return joint_move(arguments, false);
  if (name == "movj") return joint_move(arguments, true);
  if (name == "movejog") return jog(arguments);
  if (name == "do") return output_command(arguments, true);
  if (name == "speedj") return set_ratio(arguments, joint_speed_);
  if (name == "accj") return set_ratio(arguments, joint_acceleration_);
  if (name == "wait") {
    int milliseconds = 0;
    if (arguments.size() != 1) return answered(kWrongCount);
    if (!read_integer(arguments[0], milliseconds)) return answered(kWrongType - 1);
    if (milliseconds < 0 || milliseconds > 3600'000) return answered(kOutOfRange - 1);
    return accept(Wait{milliseconds * 1e-3});
  }
  return answered(kNoSuchCommand);
}

std::string DobotController::set_ratio(const Arguments& arguments, double& ratio) {
  int percent = 0;
  if (arguments.size() != 1) return answered(kWrongCount);
  if (!read_integer(arguments[0], percent)) return answered(kWrongType - 1);
  if (percent < 1 || percent > 100) return answered(kOutOfRange - 1);
  ratio = percent / 100.;
  return answered(kOk);
}

std::string DobotController::joint_move(const Arguments& arguments, bool is_pose) {
  if (arguments.size() < 4) return answered(kWrongCount);
  std::array<double, 4> target{};
  for (std::size_t i = 0; i < 4; ++i)
    if (!read_number(arguments[i], target[i])) return answered(kWrongType - 1 - static_cast<int>(i));
  if (is_pose) {
    const auto joints = joints_of(cell_.description().arm, target, cell_.target(kJ2));
    if (!joints) return answered(kFailed);
    target = *joints;
  } else {
    for (std::size_t i = 0; i < 4; ++i) target[i] = from_wire(i, target[i]);
  }
  constexpr double kRounding = 1e-7;  // the wire has six decimals
  for (std::size_t i = 0; i < 4; ++i) {
    const double value = target[i];
    if (value < cell_.limits(i).min - kRounding || value > cell_.limits(i).max + kRounding)
      return answered(kOutOfRange - 1 - static_cast<int>(i));
  }
  return accept(Move{target, speed_factor_ * joint_speed_});
}

std::string DobotController::output_command(const Arguments& arguments, bool is_queued) {
  int index = 0;
  int level = 0;
  if (arguments.size() != 2) return answered(kWrongCount);
  if (!read_integer(arguments[0], index)) return answered(kWrongType - 1);
  if (!read_integer(arguments[1], level)) return answered(kWrongType - 2);
  if (index < 1 || index > kOutputMax) return answered(kOutOfRange - 1);
  if (level != 0 && level != 1) return answered(kOutOfRange - 2);
  if (is_queued) return accept(Output{index, level == 1});
  set_output(index, level == 1);
  return answered(kOk);
}

/// J1+ ... J4-: at a tenth of the speed towards the limit, until the next order.
std::string DobotController::jog(const Arguments& arguments) {
  if (!is_enabled() || alarm_ != 0) return answered(kFailed);
  const std::string axis = arguments.empty() ? "" : arguments[0];
  if (axis.empty()) {
    for (std::size_t i = 0; i < 4; ++i) cell_.brake_axis(i);
    is_jogging_ = false;
    return answered(kOk);
  }
  if (axis.size() != 3 || std::tolower(axis[0]) != 'j' || axis[1] < '1' || axis[1] > '4' ||
      (axis[2] != '+' && axis[2] != '-'))
    return answered(kWrongType - 1);
  if (!is_queue_done()) return answered(kFailed);
  const auto index = static_cast<std::size_t>(axis[1] - '1');
  const AxisDescription& limits = cell_.limits(index);
  cell_.move_axis(index, axis[2] == '+' ? limits.max : limits.min, .1 * speed_factor_);
  is_jogging_ = true;
  return answered(kOk);
}

std::string DobotController::accept(Item item) {
  if (!is_enabled() || alarm_ != 0 || queue_.size() >= kQueueMax) return answered(kFailed);
  queue_.push_back(item);
  ++accepted_;
  run();
  return answered(kOk);
}

std::string DobotController::reset() {
  if (!is_queue_done()) ++dropped_;
  queue_.clear();
  current_.reset();
  is_jogging_ = false;
  for (std::size_t i = 0; i < 4; ++i) cell_.brake_axis(i);
  return answered(kOk);
}

void DobotController::raise_alarm(int id) {
  reset();
  alarm_ = id;
  is_enabled_ = false;
}

bool DobotController::is_moving() const {
  for (std::size_t i = 0; i < 4; ++i)
    if (cell_.is_moving(i)) return true;
  return false;
}

void DobotController::run() {
  if (is_paused_) return;
  for (;;) {
    if (current_) {
      const bool is_move = std::holds_alternative<Move>(*current_);
      if (is_move ? is_moving() : cell_.now_s() < current_end_s_) return;
      current_.reset();
    }
    if (queue_.empty()) return;
    current_ = queue_.front();
    queue_.pop_front();
    begin(*current_);
  }
}

void DobotController::begin(const Item& item) {
  current_end_s_ = cell_.now_s();
  if (const auto* move = std::get_if<Move>(&item)) {
    present();
    cell_.move_chain(kRobotChain, move->target, move->speed_scale);
  } else if (const auto* wait = std::get_if<Wait>(&item)) {
    current_end_s_ += wait->duration_s;
    if (cell_.is_gate_open()) cell_.set_gate(true, wait->duration_s);
  } else {
    const auto& output = std::get<Output>(item);
    set_output(output.index, output.is_on);
  }
}

void DobotController::set_output(int index, bool is_on) {
  const std::uint64_t mask = std::uint64_t{1} << (index - 1);
  outputs_ = is_on ? outputs_ | mask : outputs_ & ~mask;
  if (index == options_.gate_output) cell_.set_gate(is_on);
}

double DobotController::next_event_s() const {
  double next = TrueCell::kNever;
  if (current_ && !std::holds_alternative<Move>(*current_)) next = current_end_s_;
  if (is_enabled_ && enabled_s_ > cell_.now_s()) next = std::min(next, enabled_s_);
  return next;
}

int DobotController::mode() const {
  if (alarm_ != 0) return 9;
  if (!is_enabled()) return 4;
  if (is_paused_) return 10;
  if (is_jogging_) return 11;
  return !is_queue_done() || is_moving() ? 7 : 5;
}

DobotController::State DobotController::present() const {
  State state;
  state.mode = mode();
  for (std::size_t i = 0; i < 4; ++i) {
    state.positions[i] = cell_.position(i);
    state.speeds[i] = cell_.speed(i);
    state.targets[i] = cell_.target(i);
  }
  return state;
}

namespace {

template <class Value>
void put(std::string& frame, std::size_t offset, Value value) {
  frame.replace(offset, sizeof value, reinterpret_cast<const char*>(&value), sizeof value);
}

void put_axes(std::string& frame, std::size_t offset, const std::array<double, 4>& values) {
  for (std::size_t i = 0; i < 4; ++i) put(frame, offset + 8 * i, to_wire(i, values[i]));
}

}  // namespace

std::string DobotController::frame() {
  if (!faults_.is_stale(WireDevice::kRobot)) {
    last_ = present();
    stale_.reset();
  } else if (!stale_) {
    // From now on what was seen last, at rest.
    stale_ = last_;
    if (stale_->mode == 7) stale_->mode = 5;
    stale_->speeds = {};
    stale_->targets = stale_->positions;
    last_ = *stale_;
  }
  bool is_settled = last_.mode == 5;
  for (std::size_t i = 0; i < 4; ++i) is_settled = is_settled && cell_.is_settled(i);
  if (is_settled) times_.note_settled_shown(WireDevice::kRobot, cell_.now_s());
  if (!cell_.is_gate_open()) times_.note_dark_shown(cell_.now_s());
  std::string frame(kFrameBytes, '\0');
  put(frame, 0, static_cast<std::uint16_t>(kFrameBytes));
  put(frame, 16, outputs_);
  put(frame, 24, static_cast<std::uint64_t>(last_.mode));
  put(frame, 32, static_cast<std::uint64_t>(std::llround(cell_.now_s() * 1e3)));
  put(frame, 48, std::uint64_t{0x0123456789ABCDEF});
  put(frame, 64, speed_factor_ * 100);
  put_axes(frame, 192, last_.targets);
  put_axes(frame, 432, last_.positions);
  put_axes(frame, 480, last_.speeds);
  const auto& arm = cell_.description().arm;
  const auto actual = pose_of(arm, last_.positions);
  const auto wanted = pose_of(arm, last_.targets);
  for (std::size_t i = 0; i < 4; ++i) {
    put(frame, 624 + 8 * i, actual[i]);
    put(frame, 768 + 8 * i, wanted[i]);
  }
  const auto flag = [&](std::size_t offset, bool is_set) {
    put(frame, offset, static_cast<std::uint8_t>(is_set));
  };
  flag(1014, last_.mode == 7);
  flag(1015, is_paused_);
  put(frame, 1016, static_cast<std::uint8_t>(std::lround(speed_factor_ * 100)));
  put(frame, 1017, static_cast<std::uint8_t>(std::lround(joint_acceleration_ * 100)));
  flag(1026, is_enabled());
  flag(1028, last_.mode == 7);
  flag(1029, alarm_ != 0);
  flag(1030, is_jogging_);
  return frame;
}

}  // namespace hilbrush
