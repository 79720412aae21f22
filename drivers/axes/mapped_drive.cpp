#include "drivers/axes/mapped_drive.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <map>
#include <thread>

#include "drivers/driver_error.h"
#include "drivers/number_text.h"

namespace hilbrush {
namespace register_map {

std::vector<std::uint16_t> encode(const MappedRegister& reg, std::uint32_t value) {
  const auto low = static_cast<std::uint16_t>(value & 0xFFFF);
  const auto high = static_cast<std::uint16_t>(value >> 16);
  if (reg.words == 1) return {low};
  return reg.is_high_word_first ? std::vector{high, low} : std::vector{low, high};
}

std::int64_t decode(const MappedRegister& reg, std::span<const std::uint16_t> words) {
  if (reg.words == 1)
    return reg.is_signed ? static_cast<std::int16_t>(words[0]) : static_cast<std::int64_t>(words[0]);
  const std::uint32_t high = reg.is_high_word_first ? words[0] : words[1];
  const std::uint32_t low = reg.is_high_word_first ? words[1] : words[0];
  const std::uint32_t value = high << 16 | low;
  return reg.is_signed ? static_cast<std::int32_t>(value) : static_cast<std::int64_t>(value);
}

std::uint32_t to_register(const MappedRegister& reg, double steps) {
  double value = steps * reg.per_step;
  if (reg.inverse_of) value = *reg.inverse_of / value;
  const double bits = 16. * reg.words;
  const double low = reg.is_signed ? -std::exp2(bits - 1) : 0;
  const double high = (reg.is_signed ? std::exp2(bits - 1) : std::exp2(bits)) - 1;
  if (!(value >= low)) value = low;
  return static_cast<std::uint32_t>(std::llround(std::min(value, high)));
}

double to_steps(const MappedRegister& reg, std::int64_t value) {
  return static_cast<double>(value) / reg.per_step;
}

}  // namespace register_map

namespace {

constexpr double kWaitPollS = 0.001;  ///< wall, between two readings of a register

}  // namespace

MappedDrive::MappedDrive(std::shared_ptr<ModbusBus> bus, const ModbusAxisOptions& options, RegisterMap map,
                         Clock& clock)
    : bus_(std::move(bus)),
      unit_(options.unit),
      homes_to_zero_(options.homes_to_zero),
      map_(std::move(map)),
      clock_(clock) {}

void MappedDrive::connect() {
  if (!bus_->is_open()) bus_->connect();
  read();
}

std::int64_t MappedDrive::value_of(std::size_t index) {
  const MappedRegister& reg = map_.registers[index];
  std::array<std::uint16_t, 2> words{};
  const std::span<std::uint16_t> used(words.data(), static_cast<std::size_t>(reg.words));
  bus_->read(unit_, reg.address, used);
  return register_map::decode(reg, used);
}

void MappedDrive::write(const MappedRegister& reg, std::uint32_t value) {
  if (reg.is_single_write)
    bus_->write_one(unit_, reg.address, static_cast<std::uint16_t>(value));
  else
    bus_->write(unit_, reg.address, register_map::encode(reg, value));
}

/// Each register is read once, however many tests use it.
AxisDrive::Reading MappedDrive::read() {
  std::map<std::size_t, std::int64_t> values;
  const auto value = [&](std::size_t index) {
    const auto found = values.find(index);
    return found != values.end() ? found->second : values.emplace(index, value_of(index)).first->second;
  };
  const auto holds = [&](const RegisterTest& test) {
    return (static_cast<std::uint32_t>(value(test.reg)) & test.mask) == test.equals;
  };
  Reading reading;
  reading.has_fault = std::any_of(map_.fault.begin(), map_.fault.end(), holds);
  reading.is_enabled = std::all_of(map_.enabled.begin(), map_.enabled.end(), holds);
  reading.has_arrived = std::all_of(map_.arrived.begin(), map_.arrived.end(), holds);
  reading.is_homed = std::all_of(map_.homed.begin(), map_.homed.end(), holds);
  reading.position = register_map::to_steps(map_.registers[map_.position], value(map_.position));
  if (map_.setpoint)
    reading.setpoint = register_map::to_steps(map_.registers[*map_.setpoint], value(*map_.setpoint));
  if (reading.has_fault && map_.alarm) reading.alarm = static_cast<std::uint32_t>(value_of(*map_.alarm));
  return reading;
}

std::string MappedDrive::identify() {
  const Reading reading = read();
  std::string text = map_.name + ", unit " + std::to_string(unit_) + " at " + bus_->name();
  if (map_.identity) text += ", identity " + std::to_string(value_of(*map_.identity));
  text += reading.is_enabled ? ": enabled" : ": not enabled";
  text += reading.is_homed ? "" : ", no reference";
  text += ", at " + fixed_text(reading.position, 0) + " steps";
  return reading.has_fault ? text + ", " + alarm_text(reading.alarm) : text;
}

std::string MappedDrive::alarm_text(std::uint32_t alarm) const {
  return "fault 0x" + hex_text(alarm, 4);
}

void MappedDrive::wait(const RegisterStep& step, const char* gerund, const GiveUp& give_up) {
  const double deadline_s = clock_.now_s() + step.timeout_s;
  for (;;) {
    // The clock is read before the register, so that the last reading is never older than the time-out.
    const bool is_late = clock_.now_s() > deadline_s;
    const auto value = static_cast<std::uint32_t>(value_of(step.reg));
    if ((value & step.mask) == step.value) return;
    if (give_up()) throw DriverError("the axis was stopped");
    if (is_late)
      throw DriverError(bus_->name() + " unit " + std::to_string(unit_) + ": " +
                        map_.registers[step.reg].name + " stays 0x" + hex_text(value, 4) + " while " +
                        gerund + bus_->messages().text());
    std::this_thread::sleep_for(std::chrono::duration<double>(kWaitPollS));
  }
}

void MappedDrive::run(const std::vector<RegisterStep>& steps, const char* gerund, const Move* move,
                      const GiveUp& give_up) {
  using Source = RegisterStep::Source;
  for (const RegisterStep& step : steps) {
    if (give_up()) throw DriverError("the axis was stopped");
    const MappedRegister& reg = map_.registers[step.reg];
    if (step.kind == RegisterStep::Kind::kWait)
      wait(step, gerund, give_up);
    else if (step.kind == RegisterStep::Kind::kPause)
      std::this_thread::sleep_for(std::chrono::duration<double>(clock_.wall_s(step.timeout_s)));
    else if (step.source == Source::kConstant || move == nullptr)
      write(reg, step.value);
    else
      write(reg, register_map::to_register(
                     reg, step.source == Source::kTarget  ? static_cast<double>(move->target)
                          : step.source == Source::kSpeed ? static_cast<double>(move->speed)
                                                          : static_cast<double>(move->acceleration)));
  }
}

void MappedDrive::disable() {
  run(map_.disable, "disabling", nullptr, [] { return false; });
}

void MappedDrive::home(const GiveUp& give_up) {
  if (homes_to_zero_) run(map_.home, "homing", nullptr, give_up);
}

bool MappedDrive::write_ahead(const Move& move, const GiveUp& give_up) {
  if (map_.prepare.empty()) return false;
  run(map_.prepare, "preparing a move", &move, give_up);
  return true;
}

void MappedDrive::start(const Move& move, bool is_ahead, const GiveUp& give_up) {
  const bool was_stopped = is_stopped_.exchange(false);
  if (was_stopped) run(map_.resume, "resuming after a stop", nullptr, give_up);
  if (!is_ahead || was_stopped) run(map_.prepare, "preparing a move", &move, give_up);
  run(map_.move, "starting a move", &move, give_up);
}

void MappedDrive::stop() {
  is_stopped_ = true;
  run(map_.stop, "stopping", nullptr, [] { return false; });
}

void MappedDrive::clear_fault() {
  run(map_.clear_fault, "clearing a fault", nullptr, [] { return false; });
}

}  // namespace hilbrush
