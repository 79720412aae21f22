#pragma once
#include <array>
#include <cstddef>
#include <filesystem>
#include <string>
#include <variant>

#include "drivers/device_options.h"
#include "planner/cell_model/cell_description.h"

/// The `devices` of a cell file: which driver each device has, and what that driver needs to know.
///
///   "devices": {
///     "robot": {"driver": "dobot", "host": "192.168.1.6"},
///     "table": {"driver": "oriental-az", "port": "/dev/ttyUSB0", "baud": 115200, "parity": "even",
///               "axes": {"a": {"unit": 1, "steps_per_deg": 100}, "c": {"unit": 2, "steps_per_deg": 100}}},
///     "laser": {"driver": "obis", "port": "/dev/ttyACM0", "gate": {"of": "robot", "output": 1}}
///   }
/// or "simulated" for any of them, or for all.
namespace hilbrush {

struct SimulatedDevice {};

/// N axes, each a Modbus drive: of Oriental Motor's AZ family, or as a register map says.
template <std::size_t N>
struct ModbusGroupOptions {
  std::array<ModbusAxisOptions, N> axes;
  std::variant<SimulatedDevice, RegisterMap> map;  ///< no map: AZ
};

/// What opens the beam for one dot.
struct GateOptions {
  bool is_lasers_own = false;  ///< the laser's serial command; else a digital output of the robot
  int output = 1;              ///< 1...
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

  /// None is real.
  bool is_simulated() const { return robot.index() == 0 && table.index() == 0 && laser.index() == 0; }
};

class JsonObject;
/// Reads $.devices, after the rest of the cell: limits of axes and laser come from `cell`, whose devices get their
/// drivers' names. Register maps are looked for beside `cell_folder`. @throws InputError with the JSON path.
CellDeviceOptions read_cell_devices(JsonObject& devices, CellDescription& cell,
                                    const std::filesystem::path& cell_folder);

/// The devices of a cell file. @throws InputError
CellDeviceOptions load_cell_devices(const std::filesystem::path& file);
CellDeviceOptions cell_devices_from_json(const std::string& text, const std::string& origin);

}  // namespace hilbrush
