#include "config/cell_devices.h"

#include "config/cell_file.h"
#include "config/json_reader.h"
#include "config/register_map_file.h"
#include "sampling/base/angles.h"

namespace hilbrush {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSimulated = "simulated";
constexpr const char* kDobot = "dobot";
constexpr const char* kModbusAxes = "modbus-axes";
constexpr const char* kOrientalAz = "oriental-az";
constexpr const char* kObis = "obis";
constexpr const char* kCobolt = "cobolt";

struct DeviceContext {
  const CellDescription& cell;
  const fs::path& folder;
};

bool is_prismatic(std::size_t axis) {
  return axis == kJ3;
}

AxisBounds bounds_of(const AxisDescription& axis) {
  return {axis.min, axis.max, axis.speed_max, axis.acceleration_max};
}

/// Reads sign and offset; also steps_per_unit if `has_steps`, else the device counts in degrees or
/// millimeters.
AxisScale read_scale(JsonObject& json, std::size_t axis, bool has_steps) {
  const char* unit = is_prismatic(axis) ? "mm" : "deg";
  const double unit_si = is_prismatic(axis) ? 1e-3 : kDegree;
  AxisScale scale;
  if (const auto sign = json.optional_number("sign", {-1, 1})) {
    if (*sign != 1 && *sign != -1) json.refuse("sign", "neither 1 nor -1");
    scale.sign = *sign;
  }
  const std::string offset = std::string("offset_") + unit;
  if (json.has(offset)) scale.offset = json.quantity(offset, {-36000, 36000});
  const std::string steps = std::string("steps_per_") + unit;
  scale.steps_per_unit = (has_steps ? json.number(steps, {1e-3, 1e7}) : 1) / unit_si;
  return scale;
}

double read_window(JsonObject& json, std::size_t axis) {
  const std::string key = is_prismatic(axis) ? "window_mm" : "window_deg";
  if (json.has(key)) return json.quantity(key, {0, 1});
  return is_prismatic(axis) ? 5e-6 : 0.003 * kDegree;
}

std::uint16_t read_port(JsonObject& json, const std::string& key, std::uint16_t otherwise) {
  return static_cast<std::uint16_t>(json.optional_integer(key, 1, 65535).value_or(otherwise));
}

DobotOptions read_dobot(JsonObject& json, const DeviceContext& context) {
  DobotOptions options;
  options.host = json.text("host");
  options.dashboard_port = read_port(json, "dashboard_port", options.dashboard_port);
  options.motion_port = read_port(json, "motion_port", options.motion_port);
  options.feedback_port = read_port(json, "feedback_port", options.feedback_port);
  options.speed_percent = static_cast<int>(json.optional_integer("speed_percent", 1, 100).value_or(100));
  options.window_rad = read_window(json, kJ1);
  options.window_m = read_window(json, kJ3);
  for (std::size_t i = 0; i < 4; ++i) {
    options.bounds[i] = bounds_of(context.cell.axes[i]);
    options.scales[i].steps_per_unit = is_prismatic(i) ? 1e3 : 1 / kDegree;
  }
  if (json.has("axes"))
    json.object("axes", [&](JsonObject& axes) {
      for (std::size_t i = 0; i < 4; ++i)
        if (axes.has(kAxisNames[i]))
          axes.object(kAxisNames[i],
                      [&](JsonObject& axis) { options.scales[i] = read_scale(axis, i, false); });
    });
  return options;
}

/// Reads host and tcp_port, or port, baud and parity.
ModbusEndpoint read_endpoint(JsonObject& json) {
  ModbusEndpoint endpoint;
  if (json.has("host") == json.has("port"))
    json.refuse("host", "give either host (Modbus TCP) or port (Modbus RTU on a serial device)");
  if (json.has("host")) {
    endpoint.host = json.text("host");
    endpoint.tcp_port = read_port(json, "tcp_port", endpoint.tcp_port);
    return endpoint;
  }
  endpoint.port = json.text("port");
  endpoint.baud = static_cast<int>(json.optional_integer("baud", 1200, 1000000).value_or(115200));
  constexpr char kParities[]{'E', 'O', 'N'};
  endpoint.parity = kParities[json.optional_choice("parity", {"even", "odd", "none"}).value_or(0)];
  return endpoint;
}

/// `first`: index of the group's first axis among the cell's six axes.
template <std::size_t N>
ModbusGroupOptions<N> read_modbus_group(JsonObject& json, std::size_t first, bool is_mapped,
                                        const DeviceContext& context) {
  ModbusGroupOptions<N> options;
  if (is_mapped) {
    const std::string map = json.text("map");
    fs::path file;
    try {
      file = find_register_map(map, context.folder, "map");
    } catch (const InputError& error) {
      json.refuse("map", error.sentence());
    }
    options.map = load_register_map(file);
  }
  const bool is_shared = json.has("host") || json.has("port");
  ModbusEndpoint shared;
  if (is_shared) shared = read_endpoint(json);
  json.object("axes", [&](JsonObject& axes) {
    for (std::size_t i = 0; i < N; ++i) {
      const std::size_t index = first + i;
      axes.object(kAxisNames[index], [&](JsonObject& axis) {
        ModbusAxisOptions& entry = options.axes[i];
        const bool has_own = axis.has("host") || axis.has("port");
        entry.endpoint = has_own || !is_shared ? read_endpoint(axis) : shared;
        entry.unit = static_cast<int>(axis.integer("unit", 1, 247));
        entry.scale = read_scale(axis, index, true);
        entry.window = read_window(axis, index);
        entry.bounds = bounds_of(context.cell.axes[index]);
        entry.homes_to_zero = axis.optional_choice("home", {"absolute", "reference_run"}).value_or(0) == 1;
        for (std::size_t other = 0; other < i; ++other)
          if (options.axes[other].endpoint == entry.endpoint && options.axes[other].unit == entry.unit)
            axis.refuse("unit", "axis " + std::string(kAxisNames[first + other]) + " has it already");
      });
    }
  });
  return options;
}

LaserOptions read_laser_link(JsonObject& json, const DeviceContext& context) {
  LaserOptions options;
  options.port = json.text("port");
  options.baud = static_cast<int>(json.optional_integer("baud", 1200, 1000000).value_or(115200));
  options.power_min_w = context.cell.laser.power_min_w;
  options.power_max_w = context.cell.laser.power_max_w;
  if (json.has("arm_timeout_s")) options.arm_timeout_s = json.quantity("arm_timeout_s", {1, 3600});
  if (json.has("command_gap_ms")) options.command_gap_s = json.quantity("command_gap_ms", {0, 1000});
  if (json.has("heartbeat_ms")) options.heartbeat_s = json.quantity("heartbeat_ms", {1, 1000});
  options.heartbeats_missed = static_cast<int>(
      json.optional_integer("heartbeats_missed", 1, 100).value_or(options.heartbeats_missed));
  return options;
}

GateOptions read_gate(JsonObject& json, bool can_be_own, bool has_robot_outputs) {
  GateOptions gate;
  json.object("gate", [&](JsonObject& entry) {
    gate.is_lasers_own = entry.choice("of", {"robot", "laser"}) == 1;
    if (gate.is_lasers_own && !can_be_own)
      entry.refuse("of", "this laser has no serial command that is fast enough: use an output of the robot");
    if (gate.is_lasers_own) return;
    if (!has_robot_outputs) entry.refuse("of", "the robot's driver has no digital outputs");
    gate.output = static_cast<int>(entry.integer("output", 1, 24));
  });
  return gate;
}

/// Reads a driver's name, from a text or from an object's "driver"; `visit` gets the object of a real device.
template <class Visit>
void read_device(JsonObject& devices, const std::string& key, const std::vector<std::string>& known,
                 Visit visit) {
  const auto check = [&](JsonObject& at, const std::string& at_key, const std::string& name) {
    std::string all;
    for (const std::string& driver : known) {
      if (driver == name) return;
      all += (all.empty() ? "" : ", ") + driver;
    }
    at.refuse(at_key, "no driver is called \"" + name + "\"; known: " + all);
  };
  if (devices.is_text(key)) {
    const std::string name = devices.text(key, 100);
    check(devices, key, name);
    if (name != kSimulated)
      devices.refuse(key, "the driver " + name + " needs an object with the address of the device");
    return;
  }
  devices.object(key, [&](JsonObject& device) {
    const std::string name = device.text("driver", 100);
    check(device, "driver", name);
    if (name != kSimulated) visit(device, name);
  });
}

}  // namespace

CellDeviceOptions read_cell_devices(JsonObject& devices, const CellDescription& cell,
                                    const fs::path& cell_folder) {
  CellDeviceOptions options;
  const DeviceContext context{cell, cell_folder};
  read_device(devices, "robot", {kSimulated, kDobot, kModbusAxes},
              [&](JsonObject& device, const std::string& driver) {
                if (driver == kDobot)
                  options.robot = read_dobot(device, context);
                else
                  options.robot = read_modbus_group<4>(device, kJ1, true, context);
              });
  read_device(devices, "table", {kSimulated, kOrientalAz, kModbusAxes},
              [&](JsonObject& device, const std::string& driver) {
                options.table = read_modbus_group<2>(device, kTilt, driver == kModbusAxes, context);
              });
  const bool has_outputs = std::holds_alternative<DobotOptions>(options.robot);
  read_device(devices, "laser", {kSimulated, kObis, kCobolt},
              [&](JsonObject& device, const std::string& driver) {
                const LaserOptions laser = read_laser_link(device, context);
                const GateOptions gate = read_gate(device, driver == kCobolt, has_outputs);
                if (driver == kObis)
                  options.laser = ObisDevice{laser, gate};
                else
                  options.laser = CoboltDevice{laser, gate};
              });
  return options;
}

DriverNames driver_names(const CellDeviceOptions& options) {
  DriverNames names{kSimulated, kSimulated, kSimulated};
  if (std::holds_alternative<DobotOptions>(options.robot)) names.robot = kDobot;
  if (std::holds_alternative<ModbusGroupOptions<4>>(options.robot)) names.robot = kModbusAxes;
  if (const auto* axes = std::get_if<ModbusGroupOptions<2>>(&options.table))
    names.table = axes->map ? kModbusAxes : kOrientalAz;
  if (std::holds_alternative<ObisDevice>(options.laser)) names.laser = kObis;
  if (std::holds_alternative<CoboltDevice>(options.laser)) names.laser = kCobolt;
  return names;
}

}  // namespace hilbrush
