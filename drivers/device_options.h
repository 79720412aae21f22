#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

/// What the drivers need to know of one cell's devices. Plain data; config/cell_devices.h reads it from cell
/// files. Cell units: rad and m; device units are named.
namespace hilbrush {

/// One axis as the cell means it and as the device counts it: device = sign * (si - offset) * steps_per_unit.
struct AxisScale {
  double sign = 1;            ///< 1 or -1
  double offset = 0;          ///< rad or m, where the device is at 0
  double steps_per_unit = 1;  ///< steps per rad or m

  double to_device(double si) const { return sign * (si - offset) * steps_per_unit; }
  double to_si(double device) const { return device / (sign * steps_per_unit) + offset; }
};

/// What an axis may do: orders beyond it are refused.
struct AxisBounds {
  double min = 0;               ///< rad or m
  double max = 0;               ///< rad or m
  double speed_max = 0;         ///< rad/s or m/s
  double acceleration_max = 0;  ///< rad/s2 or m/s2
};

struct DobotOptions {
  std::string host;
  std::uint16_t dashboard_port = 29999;
  std::uint16_t motion_port = 30003;
  std::uint16_t feedback_port = 30004;
  int speed_percent = 100;  ///< of the controller's own limits
  /// In position: every joint within this of its target.
  double window_rad = 5.2e-5;
  double window_m = 5e-6;
  std::array<AxisScale, 4> scales;
  std::array<AxisBounds, 4> bounds;
};

/// Where a Modbus device is: host, or a serial port.
struct ModbusEndpoint {
  std::string host;
  std::uint16_t tcp_port = 502;
  std::string port;  ///< used if host is empty
  int baud = 115200;
  char parity = 'E';  ///< N, E, O

  bool operator==(const ModbusEndpoint&) const = default;
};

struct ModbusAxisOptions {
  ModbusEndpoint endpoint;
  int unit = 1;  ///< Modbus address
  AxisScale scale;
  AxisBounds bounds;
  double window = 0;           ///< in position: within this of the target, rad or m
  bool homes_to_zero = false;  ///< home() makes a reference run; else the encoder is absolute
};

/// An action of a register map: write a register, or wait until masked bits of one read as wanted.
struct RegisterStep {
  enum class Kind { kWrite, kWait, kPause };
  enum class Source { kConstant, kTarget, kSpeed, kAcceleration };
  Kind kind = Kind::kWrite;
  std::size_t reg = 0;  ///< index in RegisterMap::registers
  Source source = Source::kConstant;
  std::uint32_t value = 0;
  std::uint32_t mask = 0xFFFFFFFF;
  double timeout_s = 0.5;  ///< of a wait; length of a pause
};

/// One register, or two that make a 32-bit number.
struct MappedRegister {
  std::string name;
  int address = 0;
  int words = 1;
  bool is_high_word_first = true;
  bool is_signed = false;
  bool is_single_write = false;  ///< written by function 6 instead of 16 (one word only)
  double per_step = 1;           ///< register units of one step, step/s or step/s2
  /// For registers that hold a time instead of a rate: the value is this, divided by what it would be
  /// otherwise.
  std::optional<double> inverse_of;
};

/// Holds if the masked bits of a register equal a value.
struct RegisterTest {
  std::size_t reg = 0;
  std::uint32_t mask = 0;
  std::uint32_t equals = 0;
};

/// How a positioning drive is driven over Modbus, as data: see config/axes/*.json.
struct RegisterMap {
  std::string name;
  std::vector<MappedRegister> registers;
  std::size_t position = 0;                    ///< measured
  std::optional<std::size_t> setpoint;         ///< what the drive's profile asks for now
  std::optional<std::size_t> identity, alarm;  ///< read for people
  std::vector<RegisterTest> fault;             ///< any of them: in fault
  std::vector<RegisterTest> enabled;           ///< all of them: drive is on
  std::vector<RegisterTest> arrived;           ///< all of them: the drive says that its move is done
  std::vector<RegisterTest> homed;             ///< all of them: has its reference
  std::vector<RegisterStep> enable, disable, home, move, stop, clear_fault;
  std::vector<RegisterStep>
      prepare;  ///< before `move`: writes that start nothing, and may go ahead while light is on
  std::vector<RegisterStep> resume;  ///< before the first move after a stop
};

struct LaserOptions {
  std::string port;  ///< serial device, or tcp://HOST:PORT
  int baud = 115200;
  double power_min_w = 0;     ///< the cell file's, checked against the device's own
  double power_max_w = 0;     ///< the cell file's, checked against the device's own
  double arm_timeout_s = 30;  ///< start delay and warm-up
  /// Wall, between two commands that are answered; Cobolt lasers: what the maker's own library keeps.
  double command_gap_s = 0.1;
  double heartbeat_s = 0.02;  ///< to its guard
  int heartbeats_missed = 5;  ///< this many missing in a row disable it
};

}  // namespace hilbrush
