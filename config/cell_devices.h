#pragma once
#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>

#include "drivers/device_options.h"
#include "planner/cell_model/cell_description.h"

/// The `devices` of a cell file: the driver of each device and the options of that driver.
///
///   "devices": {
///     "robot": {"driver": "dobot", "host": "192.168.1.6"},
///     "table": {"driver": "oriental-az", "port": "/dev/ttyUSB0", "baud": 115200, "parity": "even",
///               "axes": {"a": {"unit": 1, "steps_per_deg": 100}, "c": {"unit": 2, "steps_per_deg": 100}}},
///     "laser": {"driver": "obis", "port": "/dev/ttyACM0", "gate": {"of": "robot", "output": 1}}
///   }
/// Each of them may be "simulated" instead.
namespace hilbrush {

struct SimulatedDevice {};

/// N axes, each a Modbus drive: one of Oriental Motor's AZ family, or any drive that a register map
/// describes.
template <std::size_t N>
struct ModbusGroupOptions {
  std::array<ModbusAxisOptions, N> axes;
  std::optional<RegisterMap> map;  ///< none: AZ
};

/// What switches the beam on for one dot.
struct GateOptions {
  bool is_lasers_own = false;  ///< true: a serial command of the laser; false: a digital output of the robot
  int output = 1;              ///< number of that output, from 1
};

struct ObisDevice {
  LaserOptions laser;
  GateOptions gate;
};
struct CoboltDevice {
  LaserOptions laser;
  GateOptions gate;
};

struct CellDeviceOptions {
  std::variant<SimulatedDevice, DobotOptions, ModbusGroupOptions<4>> robot;
  std::variant<SimulatedDevice, ModbusGroupOptions<2>> table;
  std::variant<SimulatedDevice, ObisDevice, CoboltDevice> laser;

  /// Whether all three devices are simulated.
  bool is_simulated() const { return robot.index() == 0 && table.index() == 0 && laser.index() == 0; }
};

/// The name of each device's driver, as the cell file writes it.
struct DriverNames {
  const char *robot, *table, *laser;
};
DriverNames driver_names(const CellDeviceOptions& options);

class JsonObject;
/// Reads $.devices, after the rest of the cell: the limits of axes and laser come from `cell`. Relative paths
/// of register maps start at `cell_folder`. @throws InputError with the JSON path.
CellDeviceOptions read_cell_devices(JsonObject& devices, const CellDescription& cell,
                                    const std::filesystem::path& cell_folder);

/// The devices of a cell file. @throws InputError
CellDeviceOptions load_cell_devices(const std::filesystem::path& file);
CellDeviceOptions cell_devices_from_json(const std::string& text, const std::string& origin);

}  // namespace hilbrush
