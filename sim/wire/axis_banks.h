#pragma once
#include <cstdint>

#include "sim/wire/fault_injector.h"
#include "sim/wire/modbus_server.h"
#include "sim/wire/time_record.h"

/// Positioning axes as banks of Modbus registers, one bank an axis, each with its maker's table of registers.
/// Positions are whole steps: `steps_per_unit` steps make one rad (or m). What each table leaves out is
/// answered with exception 2.
namespace hilbrush {

/// What all these drives have in common: an axis of the cell, in steps, and an alarm.
class DriveAxis {
 public:
  DriveAxis(std::size_t axis, double steps_per_unit, TrueCell& cell, FaultInjector& faults, TimeRecord& times)
      : axis_(axis), steps_per_unit_(steps_per_unit), cell_(cell), faults_(faults), times_(times) {}

  /// What the drive reports; while a stale report lasts, what it was when that began.
  struct Report {
    std::int32_t position = 0;   ///< measured
    std::int32_t commanded = 0;  ///< by the profile, at present
    bool is_moving = false;      ///< the profile is under way
    bool is_in_position = false;
  };
  Report report();
  std::int32_t steps(double position) const;
  /// False if the target is outside the axis's limits.
  bool move(std::int32_t target_steps, double speed_steps_s, double acceleration_steps_s2);
  void stop() { cell_.brake_axis(axis_); }
  void raise_alarm(std::uint16_t code) {
    alarm_ = code;
    stop();
  }
  void clear_alarm() { alarm_ = 0; }
  std::uint16_t alarm() const { return alarm_; }
  double home() const { return cell_.limits(axis_).home; }
  double steps_per_unit() const { return steps_per_unit_; }
  const AxisDescription& limits() const { return cell_.limits(axis_); }
  double now_s() const { return cell_.now_s(); }

 private:
  Report present() const;

  const std::size_t axis_;
  const double steps_per_unit_;
  TrueCell& cell_;
  FaultInjector& faults_;
  TimeRecord& times_;
  std::uint16_t alarm_ = 0;
  bool was_stale_ = false;
  Report last_;  ///< the newest that was not stale
};

/// A bank that is a drive of one axis.
class DriveBank : public RegisterBank {
 public:
  explicit DriveBank(const DriveAxis& axis) : drive_(axis) {}
  DriveAxis& drive() { return drive_; }

 protected:
  DriveAxis drive_;
};

/// Oriental Motor AZ: direct data operation, driver inputs and outputs. Two words a value, the high one
/// first.
class OrientalBank final : public DriveBank {
 public:
  using DriveBank::DriveBank;
  ModbusOutcome read(std::uint16_t address, std::span<std::uint16_t> values) override;
  ModbusOutcome write(std::uint16_t address, std::span<const std::uint16_t> values) override;

 private:
  std::uint32_t value_at(std::uint16_t first_register);
  void set_inputs(std::uint32_t inputs);
  void set_level_inputs(std::uint32_t inputs);
  bool start_direct_data();
  std::uint16_t outputs();

  static constexpr std::uint16_t kDirectData = 0x0058;
  static constexpr std::uint16_t kDirectDataEnd = 0x0068;
  std::array<std::uint32_t, 8> direct_{};  ///< number, type, position, speed, accel, decel, current, trigger
  std::uint32_t levels_ = 0;
  bool is_free_ = false;
};

/// CiA 402 profile position with each object at the register of its index, as on Mitsubishi's MR-JE-C: an
/// object is read or written whole, 32-bit ones as two words, the low one first.
class Cia402Bank final : public DriveBank {
 public:
  explicit Cia402Bank(const DriveAxis& axis);
  ModbusOutcome read(std::uint16_t address, std::span<std::uint16_t> values) override;
  ModbusOutcome write(std::uint16_t address, std::span<const std::uint16_t> values) override;

 private:
  enum class State { kFault, kSwitchOnDisabled, kReadyToSwitchOn, kSwitchedOn, kOperationEnabled };
  void control(std::uint16_t word);
  std::uint16_t status();

  State state_ = State::kSwitchOnDisabled;
  std::uint16_t control_ = 0;
  bool is_set_point_acknowledged_ = false;
  bool is_homed_ = true;
  bool is_homing_ = false;
  std::int8_t mode_ = 1;
  std::int32_t target_ = 0;
  std::uint32_t speed_ = 0;
  std::uint32_t acceleration_ = 0;
  std::uint32_t deceleration_ = 0;
};

/// Of the motor, as the drive is set.
inline constexpr double kLeadshineStepsPerTurn = 10'000;

/// Leadshine iDM/EL in PR mode, path 0. Two words a value, the high one first.
class LeadshineBank final : public DriveBank {
 public:
  using DriveBank::DriveBank;
  ModbusOutcome read(std::uint16_t address, std::span<std::uint16_t> values) override;
  ModbusOutcome write(std::uint16_t address, std::span<const std::uint16_t> values) override;

 private:
  std::uint16_t status();
  bool trigger(std::uint16_t code);

  std::array<std::uint16_t, 8>
      path_{};  ///< 0x6200: mode, position (2), speed, acceleration, deceleration, ...
  bool is_homed_ = true;
  bool has_command_done_ = true;
};

}  // namespace hilbrush
