#include "sim/wire/axis_banks.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace hilbrush {

DriveAxis::Report DriveAxis::present() const {
  const bool is_moving = cell_.is_moving(axis_);
  const bool is_there = cell_.is_settled(axis_) &&
                        std::abs(cell_.position(axis_) - cell_.target(axis_)) <= TrueCell::kOutOfPosition;
  return {steps(cell_.position(axis_)), steps(cell_.profile(axis_)), is_moving, is_there};
}

DriveAxis::Report DriveAxis::report() {
  if (!faults_.is_stale(WireDevice::kTable)) {
    was_stale_ = false;
    last_ = present();
    if (last_.is_in_position) times_.note_settled_shown(WireDevice::kTable, cell_.now_s());
    return last_;
  }
  // The first stale report is of the place where the axis was last seen, at rest.
  if (!was_stale_) last_ = {last_.position, last_.position, false, true};
  was_stale_ = true;
  return last_;
}

std::int32_t DriveAxis::steps(double position) const {
  return static_cast<std::int32_t>(std::lround(position * steps_per_unit_));
}

bool DriveAxis::move(std::int32_t target_steps, double speed_steps_s, double acceleration_steps_s2) {
  const double target = target_steps / steps_per_unit_;
  const double half_step = .5 / steps_per_unit_;
  if (target < limits().min - half_step || target > limits().max + half_step) return false;
  if (!(speed_steps_s > 0) || !(acceleration_steps_s2 > 0)) return false;
  report();
  cell_.move_axis(axis_, target, speed_steps_s / steps_per_unit_, acceleration_steps_s2 / steps_per_unit_);
  return true;
}

namespace {

std::uint16_t high_word(std::uint32_t value) {
  return static_cast<std::uint16_t>(value >> 16);
}
std::uint16_t low_word(std::uint32_t value) {
  return static_cast<std::uint16_t>(value & 0xffff);
}
constexpr std::uint16_t bit(int number) {
  return static_cast<std::uint16_t>(1u << number);
}

}  // namespace

// ---- Oriental Motor AZ

ModbusOutcome OrientalBank::read(std::uint16_t address, std::span<std::uint16_t> values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto here = static_cast<std::uint16_t>(address + i);
    const auto first = static_cast<std::uint16_t>(here & ~1u);
    const bool is_direct = first >= kDirectData && first < kDirectDataEnd;
    const bool is_known = is_direct || first == 0x007C || first == 0x007E || first == 0x0080 ||
                          first == 0x0120 || first == 0x0122;
    if (!is_known) return ModbusOutcome::kIllegalAddress;
    const std::uint32_t value = value_at(first);
    values[i] = here == first ? high_word(value) : low_word(value);
  }
  return ModbusOutcome::kDone;
}

std::uint32_t OrientalBank::value_at(std::uint16_t first_register) {
  switch (first_register) {
    case 0x007C:
      return levels_;
    case 0x007E:
      return outputs();
    case 0x0080:
      return drive_.alarm();
    case 0x0120:
      return static_cast<std::uint32_t>(drive_.report().position);
    case 0x0122:
      return static_cast<std::uint32_t>(drive_.report().commanded);
    default:
      return direct_[static_cast<std::size_t>(first_register - kDirectData) / 2];
  }
}

std::uint16_t OrientalBank::outputs() {
  const DriveAxis::Report report = drive_.report();
  const bool has_alarm = drive_.alarm() != 0;
  std::uint16_t word = 0;
  word |= bit(4);                                                    // HOME-END: the encoder is absolute
  if (!has_alarm && !is_free_ && !report.is_moving) word |= bit(5);  // READY
  if (has_alarm) word |= bit(7);
  if (report.is_moving) word |= bit(13);
  if (report.is_in_position) word |= bit(14);
  return word;
}

ModbusOutcome OrientalBank::write(std::uint16_t address, std::span<const std::uint16_t> values) {
  if (address % 2 != 0 || values.size() % 2 != 0) {
    // Half a value: only the low words of the inputs are written alone.
    if (values.size() != 1 || (address != 0x0079 && address != 0x007D)) return ModbusOutcome::kIllegalAddress;
    address == 0x0079 ? set_inputs(values[0]) : set_level_inputs(values[0]);
    return ModbusOutcome::kDone;
  }
  const std::size_t end = address + values.size();
  const bool is_direct = address >= kDirectData && end <= kDirectDataEnd;
  const bool is_inputs = (address == 0x0078 || address == 0x007C) && values.size() == 2;
  if (!is_direct && !is_inputs) return ModbusOutcome::kIllegalAddress;
  bool is_triggered = false;
  for (std::size_t i = 0; i < values.size(); i += 2) {
    const std::uint32_t value = static_cast<std::uint32_t>(values[i]) << 16 | values[i + 1];
    const std::size_t place = address + i;
    if (place == 0x0078) {
      set_inputs(value);
    } else if (place == 0x007C) {
      set_level_inputs(value);
    } else {
      direct_[(place - kDirectData) / 2] = value;
      is_triggered = is_triggered || (place == 0x0066 && value == 1);
    }
  }
  return !is_triggered || start_direct_data() ? ModbusOutcome::kDone : ModbusOutcome::kDeviceFailure;
}

void OrientalBank::set_level_inputs(std::uint32_t inputs) {
  set_inputs(inputs & ~levels_);  // they act on their rising edge
  levels_ = inputs;
  is_free_ = (inputs & bit(6)) != 0;
}

void OrientalBank::set_inputs(std::uint32_t inputs) {
  if (inputs & bit(5)) drive_.stop();
  if (inputs & bit(7)) drive_.clear_alarm();
  if ((inputs & bit(4)) && drive_.alarm() == 0 && !is_free_)
    drive_.move(drive_.steps(drive_.home()), drive_.limits().speed_max * drive_.steps_per_unit() / 4,
                drive_.limits().acceleration_max * drive_.steps_per_unit() / 4);
}

/// Speed in steps/s, acceleration in 0.001 kHz/s = steps/s2, current in 0.1 %.
bool OrientalBank::start_direct_data() {
  const auto& [number, type, position, speed, acceleration, deceleration, current, trigger] = direct_;
  constexpr std::uint32_t kAbsolute = 1;
  constexpr std::uint32_t kIncremental = 2;
  if (drive_.alarm() != 0 || is_free_ || number > 255 || current > 1000) return false;
  if (type != kAbsolute && type != kIncremental) return false;
  auto target = static_cast<std::int32_t>(position);
  if (type == kIncremental) target += drive_.report().position;
  const bool is_started = drive_.move(target, speed, std::min(acceleration, deceleration));
  direct_.back() = 0;
  return is_started;
}

// ---- CiA 402

Cia402Bank::Cia402Bank(const DriveAxis& axis) : DriveBank(axis) {
  speed_ = static_cast<std::uint32_t>(drive_.limits().speed_max * drive_.steps_per_unit());
  acceleration_ = deceleration_ =
      static_cast<std::uint32_t>(drive_.limits().acceleration_max * drive_.steps_per_unit());
  target_ = drive_.report().position;
}

namespace {

/// Words of an object, 0 if there is none.
std::size_t cia402_words(std::uint16_t index) {
  switch (index) {
    case 0x6040:
    case 0x6041:
    case 0x6060:
    case 0x6061:
    case 0x603F:
      return 1;
    case 0x6064:
    case 0x607A:
    case 0x6081:
    case 0x6083:
    case 0x6084:
      return 2;
    default:
      return 0;
  }
}

}  // namespace

ModbusOutcome Cia402Bank::read(std::uint16_t address, std::span<std::uint16_t> values) {
  if (values.size() != cia402_words(address)) return ModbusOutcome::kIllegalAddress;
  std::uint32_t value = 0;
  switch (address) {
    case 0x6040:
      value = control_;
      break;
    case 0x6041:
      value = status();
      break;
    case 0x6060:
    case 0x6061:
      value = static_cast<std::uint8_t>(mode_);
      break;
    case 0x603F:
      value = drive_.alarm();
      break;
    case 0x6064:
      value = static_cast<std::uint32_t>(drive_.report().position);
      break;
    case 0x607A:
      value = static_cast<std::uint32_t>(target_);
      break;
    case 0x6081:
      value = speed_;
      break;
    case 0x6083:
      value = acceleration_;
      break;
    default:
      value = deceleration_;
  }
  values[0] = low_word(value);
  if (values.size() == 2) values[1] = high_word(value);
  return ModbusOutcome::kDone;
}

ModbusOutcome Cia402Bank::write(std::uint16_t address, std::span<const std::uint16_t> values) {
  if (values.size() != cia402_words(address)) return ModbusOutcome::kIllegalAddress;
  const std::uint32_t value =
      values[0] | (values.size() == 2 ? static_cast<std::uint32_t>(values[1]) << 16 : 0);
  switch (address) {
    case 0x6040:
      control(values[0]);
      return ModbusOutcome::kDone;
    case 0x6060:
      if (value != 1 && value != 6) return ModbusOutcome::kIllegalValue;
      mode_ = static_cast<std::int8_t>(value);
      return ModbusOutcome::kDone;
    case 0x607A:
      target_ = static_cast<std::int32_t>(value);
      return ModbusOutcome::kDone;
    case 0x6081:
      speed_ = value;
      return ModbusOutcome::kDone;
    case 0x6083:
      acceleration_ = value;
      return ModbusOutcome::kDone;
    case 0x6084:
      deceleration_ = value;
      return ModbusOutcome::kDone;
    default:
      return ModbusOutcome::kIllegalAddress;  // read only
  }
}

/// The state machine of CiA 402 part 2, as far as profile position and homing need it.
void Cia402Bank::control(std::uint16_t word) {
  const std::uint16_t before = std::exchange(control_, word);
  const auto rises = [&](int number) { return (word & bit(number)) != 0 && (before & bit(number)) == 0; };
  if (drive_.alarm() != 0) state_ = State::kFault;
  if (state_ == State::kFault) {
    if (!rises(7)) return;
    drive_.clear_alarm();
    state_ = State::kSwitchOnDisabled;
    return;
  }
  const bool has_voltage = word & bit(1), is_not_quick_stop = word & bit(2), is_switched = word & bit(0),
             is_enabled = word & bit(3);
  if (!has_voltage || !is_not_quick_stop) {
    drive_.stop();
    state_ = State::kSwitchOnDisabled;
    return;
  }
  if (!is_switched) {
    drive_.stop();
    state_ = State::kReadyToSwitchOn;
    return;
  }
  if (state_ == State::kSwitchOnDisabled) return;  // must pass through "shutdown" first
  if (!is_enabled) {
    state_ = State::kSwitchedOn;
    return;
  }
  state_ = State::kOperationEnabled;
  if (word & bit(8)) {
    drive_.stop();
    return;
  }
  if (!(word & bit(4))) is_set_point_acknowledged_ = false;
  if (!rises(4)) return;
  if (mode_ == 6) {
    is_homing_ = true;
    drive_.move(drive_.steps(drive_.home()), speed_, acceleration_);
    return;
  }
  const std::int32_t target = word & bit(6) ? drive_.report().position + target_ : target_;
  if (drive_.move(target, speed_, std::min(acceleration_, deceleration_)))
    is_set_point_acknowledged_ = true;
  else
    drive_.raise_alarm(0x8612);  // reference limit
}

std::uint16_t Cia402Bank::status() {
  const DriveAxis::Report report = drive_.report();
  if (drive_.alarm() != 0) state_ = State::kFault;
  if (is_homing_ && report.is_in_position) {
    is_homing_ = false;
    is_homed_ = true;
  }
  std::uint16_t word = bit(9) | bit(4);
  if (state_ == State::kFault) word |= bit(3);
  if (state_ == State::kSwitchOnDisabled) word |= bit(6);
  if (state_ >= State::kReadyToSwitchOn) word |= static_cast<std::uint16_t>(bit(0) | bit(5));
  if (state_ >= State::kSwitchedOn) word |= bit(1);
  if (state_ == State::kOperationEnabled) word |= bit(2);
  if (report.is_in_position) word |= bit(10);
  if (mode_ == 6 ? is_homed_ && !is_homing_ : is_set_point_acknowledged_) word |= bit(12);
  return word;
}

// ---- Leadshine PR

ModbusOutcome LeadshineBank::read(std::uint16_t address, std::span<std::uint16_t> values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto here = static_cast<std::uint16_t>(address + i);
    if (here == 0x1003)
      values[i] = status();
    else if (here == 0x602C)
      values[i] = high_word(static_cast<std::uint32_t>(drive_.report().position));
    else if (here == 0x602D)
      values[i] = low_word(static_cast<std::uint32_t>(drive_.report().position));
    else if (here == 0x2203)
      values[i] = drive_.alarm();
    else if (here == 0x6002)
      values[i] = 0;  // obeyed at once
    else if (here >= 0x6200 && here < 0x6200 + path_.size())
      values[i] = path_[here - 0x6200];
    else
      return ModbusOutcome::kIllegalAddress;
  }
  return ModbusOutcome::kDone;
}

std::uint16_t LeadshineBank::status() {
  const DriveAxis::Report report = drive_.report();
  std::uint16_t word = 0;
  if (drive_.alarm() != 0) word |= bit(0);
  word |= bit(1);
  if (report.is_moving) word |= bit(2);
  if (!report.is_moving && has_command_done_) word |= bit(4);
  if (report.is_in_position) word |= bit(5);
  if (is_homed_) word |= bit(6);
  return word;
}

ModbusOutcome LeadshineBank::write(std::uint16_t address, std::span<const std::uint16_t> values) {
  if (address == 0x6002 && values.size() == 1)
    return trigger(values[0]) ? ModbusOutcome::kDone : ModbusOutcome::kDeviceFailure;
  if (address == 0x1801 && values.size() == 1) {
    if (values[0] == 0x1111) drive_.clear_alarm();
    return ModbusOutcome::kDone;
  }
  if (address < 0x6200 || address + values.size() > 0x6200 + path_.size())
    return ModbusOutcome::kIllegalAddress;
  std::copy(values.begin(), values.end(), path_.begin() + (address - 0x6200));
  // Path 0 may carry its trigger along, in its last word.
  if (address + values.size() == 0x6208 && path_[7] == 0x10)
    return trigger(0x10) ? ModbusOutcome::kDone : ModbusOutcome::kDeviceFailure;
  return ModbusOutcome::kDone;
}

/// Speed in rpm of the motor; accelerations as the milliseconds in which its speed changes by 1000 rpm.
bool LeadshineBank::trigger(std::uint16_t code) {
  if (code == 0x40) {
    drive_.stop();
    return true;
  }
  if (drive_.alarm() != 0) return false;
  constexpr double kTurn = kLeadshineStepsPerTurn;
  const double speed = path_[3] / 60. * kTurn;
  const double ramp_ms = std::max<double>({1, static_cast<double>(path_[4]), static_cast<double>(path_[5])});
  const double acceleration = 1000. / 60 * kTurn / (ramp_ms * 1e-3);
  if (code == 0x20)
    return drive_.move(drive_.steps(drive_.home()), speed > 0 ? speed : kTurn / 4, acceleration);
  if (code != 0x10) return false;
  auto target = static_cast<std::int32_t>(static_cast<std::uint32_t>(path_[1]) << 16 | path_[2]);
  if (path_[0] == 0x41)
    target += drive_.report().position;
  else if (path_[0] != 1)
    return false;
  return drive_.move(target, speed, acceleration);
}

}  // namespace hilbrush
