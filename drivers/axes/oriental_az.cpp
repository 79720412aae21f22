#include "drivers/axes/oriental_az.h"

#include <chrono>
#include <thread>

#include "drivers/driver_error.h"
#include "drivers/number_text.h"

namespace hilbrush {
namespace oriental_az {
namespace {

void put(DirectData& data, std::size_t index, std::uint32_t value) {
  data[2 * index] = static_cast<std::uint16_t>(value >> 16);
  data[2 * index + 1] = static_cast<std::uint16_t>(value & 0xFFFF);
}

std::int32_t signed_at(std::span<const std::uint16_t, 4> words, std::size_t index) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(words[index]) << 16 | words[index + 1]);
}

}  // namespace

DirectData encode_move(const AxisDrive::Move& move, Trigger trigger) {
  constexpr std::uint32_t kOperationData = 0;
  constexpr std::uint32_t kAbsolute = 1;
  constexpr std::uint32_t kFullCurrent = 1000;
  DirectData data{};
  put(data, 0, kOperationData);
  put(data, 1, kAbsolute);
  put(data, 2, static_cast<std::uint32_t>(move.target));
  put(data, 3, move.speed);
  put(data, 4, move.acceleration);
  put(data, 5, move.acceleration);
  put(data, 6, kFullCurrent);
  put(data, 7, static_cast<std::uint32_t>(trigger));
  return data;
}

std::array<std::uint16_t, 2> encode_trigger(Trigger trigger) {
  const auto value = static_cast<std::uint32_t>(trigger);
  return {static_cast<std::uint16_t>(value >> 16), static_cast<std::uint16_t>(value & 0xFFFF)};
}

AxisDrive::Reading decode_reading(std::uint16_t output, std::span<const std::uint16_t, 4> position_words) {
  AxisDrive::Reading reading;
  reading.position = signed_at(position_words, 0);
  reading.setpoint = signed_at(position_words, 2);
  reading.has_fault = (output & kAlarm) != 0;
  reading.has_arrived = (output & kInPosition) != 0 && (output & kMove) == 0;
  reading.is_enabled = reading.is_homed = (output & (kReady | kMove | kBusy)) != 0;
  return reading;
}

/// What a number means depends on the model of the drive.
std::string alarm_text(std::uint32_t alarm) {
  return "alarm 0x" + hex_text(alarm, 2) + " (see the drive's manual)";
}

}  // namespace oriental_az

using namespace oriental_az;

OrientalDrive::OrientalDrive(std::shared_ptr<ModbusBus> bus, const ModbusAxisOptions& options)
    : bus_(std::move(bus)), unit_(options.unit), homes_to_zero_(options.homes_to_zero) {}

void OrientalDrive::connect() {
  if (!bus_->is_open()) bus_->connect();
  read();
}

std::string OrientalDrive::identify() {
  const Reading reading = read();
  return "AZ drive, unit " + std::to_string(unit_) + " at " + bus_->name() + ": " +
         (reading.is_enabled ? "ready" : "not ready") + ", at " + fixed_text(reading.position, 0) + " steps" +
         (reading.has_fault ? ", " + alarm_text(reading.alarm) : "");
}

AxisDrive::Reading OrientalDrive::read() {
  std::array<std::uint16_t, 1> output{};
  std::array<std::uint16_t, 4> position{};
  bus_->read(unit_, kDriverOutputAt, output);
  bus_->read(unit_, kPositionAt, position);
  Reading reading = decode_reading(output[0], position);
  if (reading.has_fault) {
    std::array<std::uint16_t, 2> alarm{};
    bus_->read(unit_, kAlarmAt, alarm);
    reading.alarm = static_cast<std::uint32_t>(alarm[0]) << 16 | alarm[1];
  }
  return reading;
}

void OrientalDrive::set_inputs(std::uint16_t inputs) {
  bus_->write(unit_, kDriverInputAt, {&inputs, 1});
  is_stop_held_ = (inputs & kStop) != 0;
}

/// The drive samples its inputs every few milliseconds and must see an input for 20 ms.
void OrientalDrive::pulse_input(std::uint16_t input) {
  set_inputs(input);
  std::this_thread::sleep_for(std::chrono::milliseconds(25));
  set_inputs(0);
}

/// FREE off: the motor is excited and holds.
void OrientalDrive::enable(const GiveUp&) {
  set_inputs(0);
}

/// Stopped and holding: FREE would let a tilted table fall.
void OrientalDrive::disable() {
  stop();
}

void OrientalDrive::home(const GiveUp& give_up) {
  set_inputs(0);
  if (!homes_to_zero_) return;  // an absolute encoder
  pulse_input(kHome);
  for (int i = 0; i < 12000; ++i) {
    const Reading reading = read();
    if (reading.has_fault)
      throw DriverError("the axis reports " + alarm_text(reading.alarm) + " while homing");
    if (reading.has_arrived && i > 4) return;
    if (give_up()) throw DriverError("homing was stopped");
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  throw DriverError("the axis does not finish homing");
}

/// The write sets the trigger to "none", so nothing starts, whatever value the trigger had before.
bool OrientalDrive::write_ahead(const Move& move, const GiveUp&) {
  bus_->write(unit_, kDirectDataAt, encode_move(move, Trigger::kNone));
  return true;
}

void OrientalDrive::start(const Move& move, bool is_ahead, const GiveUp&) {
  if (is_ahead && !is_stop_held_) return bus_->write(unit_, kTriggerAt, encode_trigger(Trigger::kAllData));
  if (is_stop_held_) set_inputs(0);
  bus_->write(unit_, kDirectDataAt, encode_move(move, Trigger::kAllData));
}

/// The level stays until the next move, so that an order from elsewhere cannot move the axis in between.
void OrientalDrive::stop() {
  set_inputs(kStop);
}

void OrientalDrive::clear_fault() {
  pulse_input(kAlarmReset);
}

}  // namespace hilbrush
