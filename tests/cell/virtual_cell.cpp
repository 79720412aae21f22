#include "tests/cell/virtual_cell.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

#include "drivers/driver_error.h"

namespace hilbrush::test {
namespace {

constexpr double kWindow = 5e-5;  ///< rad, m

std::string printed(double value) {
  return fmt::format("{:.6f}", value);
}
double wire_unit(std::size_t axis) {
  return axis == kJ3 ? 1e-3 : std::numbers::pi / 180;
}

template <std::size_t N>
bool is_near(const std::array<double, N>& a, const std::array<double, N>& b) {
  for (std::size_t i = 0; i < N; ++i)
    if (!(std::abs(a[i] - b[i]) <= kWindow)) return false;
  return true;
}

}  // namespace

void VirtualClock::sleep_until(double time_s) {
  constexpr double kMaxS = 3600;
  devices_.advance(std::min(time_s, now_s() + kMaxS));
  if (on_time) on_time();
}

void VirtualLink::lose(const std::string& how) {
  lost_ = how;
  throw DriverError("the " + std::string(kWireDeviceNames[static_cast<std::size_t>(device_)]) + " " + how);
}

void VirtualLink::exchange(const std::function<bool()>& act) {
  const std::string name = std::string("the ") + kWireDeviceNames[static_cast<std::size_t>(device_)];
  if (is_lost()) throw DriverError(name + " was lost: it " + lost_);
  devices_.advance(clock_.now_s() + kExchangeS);
  if (clock_.on_time) clock_.on_time();
  const auto obey = [&] {
    const bool is_done = act();
    devices_.observe();
    return is_done;
  };
  if (devices_.faults().is_line_down(device_)) {
    devices_.advance(clock_.now_s() + kReplyTimeoutS);
    lose("does not answer");
  }
  const auto fault = devices_.faults().on_message(device_);
  if (!fault) {
    if (!obey()) throw DriverError(name + " refuses");
    return;
  }
  switch (fault->kind) {
    case WireFaultKind::kSilence:
      obey();
      [[fallthrough]];
    case WireFaultKind::kLostRequest:
      devices_.advance(clock_.now_s() + kReplyTimeoutS);
      lose("does not answer");
    case WireFaultKind::kHalfFrame:
      obey();
      devices_.advance(clock_.now_s() + kReplyTimeoutS);
      lose("answers in halves");
    case WireFaultKind::kWrongId:
    case WireFaultKind::kWrongChecksum:
      obey();
      lose("sent an answer to no command");
    case WireFaultKind::kDroppedConnection:
      devices_.faults().set_line_down(device_, fault->duration_s);
      lose("closed the connection");
    case WireFaultKind::kLateAnswer:
      obey();
      devices_.advance(clock_.now_s() + std::min(fault->duration_s, kReplyTimeoutS));
      if (fault->duration_s > kReplyTimeoutS) lose("does not answer");
      return;
    default:
      throw DriverError(name + " refuses");
  }
}

void VirtualDevice::fail(const std::string& sentence) {
  state_ = DeviceState::kFault;
  fault_ = sentence;
}

void VirtualDevice::fault_if_lost() {
  if (!link_.is_lost() || state_ == DeviceState::kDisconnected || state_ == DeviceState::kFault) return;
  fail("it " + link_.why());
}

// ---- axes

template <std::size_t N>
void VirtualAxes<N>::home() {
  state_ = DeviceState::kReady;
  has_target_ = false;
}

template <std::size_t N>
void VirtualAxes<N>::disable() noexcept {
  stop();
  if (state_ != DeviceState::kFault) state_ = DeviceState::kConnected;
}

template <std::size_t N>
void VirtualAxes<N>::move_to(const Positions& target, double settle_s) {
  if (state_ != DeviceState::kReady) throw DriverError("the axes are not ready");
  has_target_ = false;
  target_ = target;
  settle_s_ = settle_s;
  rest_since_s_ = -1;
  order_move(target);
  has_target_ = true;
}

template <std::size_t N>
typename VirtualAxes<N>::Status VirtualAxes<N>::status() {
  if (state_ != DeviceState::kDisconnected && !link_.is_lost()) read_state();
  fault_if_lost();
  judge();
  const double now_s = clock_.now_s();
  if (!has_target_ || !is_at_rest() || !is_near(seen_, target_))
    rest_since_s_ = -1;
  else if (rest_since_s_ < 0)
    rest_since_s_ = now_s;
  Status status;
  status.in_position = state_ == DeviceState::kReady && has_target_ && rest_since_s_ >= 0 &&
                       now_s >= rest_since_s_ + settle_s_;
  status.state =
      state_ == DeviceState::kReady && has_target_ && !status.in_position ? DeviceState::kMoving : state_;
  status.positions = seen_;
  status.fault = fault_;
  return status;
}

template <std::size_t N>
double VirtualAxes<N>::expected_arrival_s() {
  return rest_since_s_ >= 0 ? rest_since_s_ + settle_s_ : clock_.now_s();
}

template <std::size_t N>
void VirtualAxes<N>::stop() noexcept {
  has_target_ = false;
  try {
    order_stop();
  } catch (const DriverError& error) {
    if (state_ == DeviceState::kReady || state_ == DeviceState::kEnabled) fail(error.what());
  }
}

template class VirtualAxes<4>;
template class VirtualAxes<2>;

// ---- robot

void VirtualRobot::command(bool is_motion, const std::string& name,
                           const std::vector<std::string>& arguments) {
  link_.exchange([&] {
    auto& controller = devices_.robot();
    const std::string answer =
        is_motion ? controller.motion(name, arguments) : controller.dashboard(name, arguments);
    return answer.starts_with("0,");
  });
}

/// A frame, as it comes every 8 ms without being asked.
void VirtualRobot::read_state() {
  try {
    link_.exchange([&] {
      const std::string frame = devices_.robot().frame();
      std::uint64_t mode = 0;
      std::uint64_t outputs = 0;
      std::memcpy(&outputs, frame.data() + 16, sizeof outputs);
      std::memcpy(&mode, frame.data() + 24, sizeof mode);
      mode_ = static_cast<int>(mode);
      is_output_on_ = (outputs & 1) != 0;
      for (std::size_t i = 0; i < 4; ++i) {
        double value = 0;
        std::memcpy(&value, frame.data() + 432 + 8 * i, sizeof value);
        seen_[i] = value * wire_unit(i);
      }
      return true;
    });
  } catch (const DriverError&) {  // one frame less, or a lost link
  }
}

void VirtualRobot::connect() {
  link_.connect();
  command(false, "robotmode", {});
  state_ = DeviceState::kConnected;
}
void VirtualRobot::enable() {
  command(false, "enablerobot", {});
  clock_.sleep_until(clock_.now_s() + .3);
  command(false, "resetrobot", {});
  read_state();
  if (mode_ != 5) throw DriverError("the robot is not enabled");
  state_ = DeviceState::kEnabled;
}
void VirtualRobot::clear_fault() {
  link_.connect();
  command(false, "resetrobot", {});
  command(false, "clearerror", {});
  fault_.clear();
  state_ = DeviceState::kConnected;
}

void VirtualRobot::order_move(const Positions& target) {
  std::vector<std::string> arguments;
  for (std::size_t i = 0; i < 4; ++i) arguments.push_back(printed(target[i] / wire_unit(i)));
  command(true, "jointmovj", arguments);
}

void VirtualRobot::judge() {
  const bool is_on = state_ == DeviceState::kReady || state_ == DeviceState::kEnabled;
  constexpr int kAlarm = 9;
  if ((is_on && mode_ != 5 && mode_ != 7) || (state_ == DeviceState::kConnected && mode_ == kAlarm))
    fail("the robot is in alarm");
}

/// Its queue runs as long as a pulse does.
bool VirtualRobot::is_at_rest() const {
  return mode_ == 5 || (mode_ == 7 && is_output_on_);
}

void VirtualRobot::pulse(double pulse_s) {
  if (state_ != DeviceState::kReady) throw DriverError("the robot is not ready");
  link_.exchange([&] {
    auto& controller = devices_.robot();
    const bool is_accepted = controller.motion("do", {"1", "1"}).starts_with("0,");
    controller.motion("wait", {std::to_string(std::lround(pulse_s * 1e3))});
    controller.motion("do", {"1", "0"});
    return is_accepted;
  });
}

bool VirtualRobot::gate_off() noexcept {
  try {
    if (link_.is_lost()) link_.connect();  // the immediate port is another connection
    // Off first: clearing the queue drops the off that waits in it. Then again, should an on have come
    // between.
    link_.exchange([&] {
      auto& controller = devices_.robot();
      controller.dashboard("doexecute", {"1", "0"});
      controller.dashboard("resetrobot", {});
      return controller.dashboard("doexecute", {"1", "0"}).starts_with("0,");
    });
    return true;
  } catch (const DriverError&) {
    return false;
  }
}

bool VirtualRobot::is_gate_on() {
  if (!link_.is_lost()) read_state();
  return is_output_on_;
}

// ---- table

void VirtualTable::read_state() {
  try {
    link_.exchange([&] {
      is_reported_there_ = true;
      for (std::size_t i = 0; i < 2; ++i) {
        DriveAxis& axis = devices_.table_axis(i);
        const DriveAxis::Report report = axis.report();
        seen_[i] = report.position / axis.steps_per_unit();
        is_reported_there_ = is_reported_there_ && report.is_in_position && !report.is_moving;
        if (axis.alarm() != 0) fail("the table is in alarm");
      }
      return true;
    });
  } catch (const DriverError&) {  // one reading less, or a lost link
  }
}

void VirtualTable::connect() {
  link_.connect();
  link_.exchange([] { return true; });
  state_ = DeviceState::kConnected;
}
void VirtualTable::enable() {
  link_.exchange([] { return true; });
  state_ = DeviceState::kEnabled;
}
void VirtualTable::clear_fault() {
  link_.connect();
  link_.exchange([&] {
    for (std::size_t i = 0; i < 2; ++i) devices_.table_axis(i).clear_alarm();
    return true;
  });
  fault_.clear();
  state_ = DeviceState::kConnected;
}

void VirtualTable::order_move(const Positions& target) {
  for (std::size_t i = 0; i < 2; ++i)
    link_.exchange([&] {
      DriveAxis& axis = devices_.table_axis(i);
      return axis.alarm() == 0 &&
             axis.move(axis.steps(target[i]), axis.limits().speed_max * axis.steps_per_unit(),
                       axis.limits().acceleration_max * axis.steps_per_unit());
    });
}

void VirtualTable::order_stop() {
  link_.exchange([&] {
    for (std::size_t i = 0; i < 2; ++i) devices_.table_axis(i).stop();
    return true;
  });
}

// ---- laser

Laser::Limits VirtualLaser::limits() {
  const auto& laser = devices_.cell().description().laser;
  return {laser.power_min_w, laser.power_max_w, laser.pulse_min_s, laser.pulse_max_s};
}

void VirtualLaser::connect() {
  if (!robot_.gate_off()) throw DriverError("the gate does not confirm that it is off");
  link_.connect();
  link_.exchange([&] {
    devices_.cell().set_emission(false);
    devices_.cell().set_modulation(TrueCell::Modulation::kWired);
    return true;
  });
  state_ = DeviceState::kConnected;
}

void VirtualLaser::enable() {
  if (!robot_.gate_off()) throw DriverError("the gate does not confirm that it is off");
  link_.exchange([&] {
    const auto& limits = devices_.cell().description().laser;
    return devices_.cell().power_max_w() >= limits.power_max_w && devices_.cell().set_emission(true);
  });
  while (devices_.cell().is_in_start_delay()) clock_.sleep_until(clock_.now_s() + .01);
  power_w_ = devices_.cell().power_w();
  if (!devices_.cell().is_emission_ordered())
    throw DriverError("the laser was turned off again in its start delay");
  state_ = DeviceState::kReady;
}

void VirtualLaser::disable() noexcept {
  robot_.gate_off();
  for (int attempt = 0; attempt < 2; ++attempt) {
    try {
      if (link_.is_lost()) link_.connect();
      link_.exchange([&] { return devices_.cell().set_emission(false); });
      break;
    } catch (const DriverError&) {
    }
  }
  if (state_ == DeviceState::kReady || state_ == DeviceState::kEnabled) state_ = DeviceState::kConnected;
}

void VirtualLaser::prepare(double power_w, double) {
  if (state_ != DeviceState::kReady) throw DriverError("the laser is not armed");
  if (power_w == power_w_) return;
  link_.exchange([&] {
    if (power_w > devices_.cell().power_max_w()) return false;
    devices_.cell().set_power(power_w);
    power_w_ = power_w;
    return true;
  });
}

void VirtualLaser::fire(double power_w, double pulse_s) {
  prepare(power_w, pulse_s);
  robot_.pulse(pulse_s);
}

bool VirtualLaser::off() noexcept {
  if (robot_.gate_off() || robot_.gate_off()) return true;
  // What closes no gate goes dark at its source.
  disable();
  return false;
}

Laser::Status VirtualLaser::status() {
  if (state_ != DeviceState::kDisconnected && !link_.is_lost()) {
    try {
      link_.exchange([&] {
        is_closed_ = devices_.cell().is_interlock_closed();
        if (devices_.cell().is_tripped() && state_ == DeviceState::kReady) fail("the interlock was opened");
        if (devices_.cell().power_w() != power_w_ && state_ == DeviceState::kReady)
          fail("its power is not what was set");
        if (!devices_.cell().is_emission_ordered() && state_ == DeviceState::kReady)
          state_ = DeviceState::kConnected;
        return true;
      });
    } catch (const DriverError&) {  // one reading less, or a lost link
    }
  }
  fault_if_lost();
  Status status;
  status.is_emitting = robot_.is_gate_on();
  status.state = status.is_emitting && state_ == DeviceState::kReady ? DeviceState::kMoving : state_;
  status.interlock_closed = is_closed_;
  status.fault = fault_;
  return status;
}

void VirtualLaser::clear_fault() {
  link_.connect();
  if (!robot_.gate_off()) throw DriverError("the gate does not confirm that it is off");
  link_.exchange([&] {
    if (!devices_.cell().is_interlock_closed()) return false;
    return devices_.cell().set_emission(false);
  });
  fault_.clear();
  state_ = DeviceState::kConnected;
}

}  // namespace hilbrush::test
