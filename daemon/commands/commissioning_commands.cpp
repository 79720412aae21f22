#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <functional>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "config/cell_file.h"
#include "daemon/commands/command_context.h"
#include "daemon/commands/exit_code.h"
#include "daemon/commands/interrupt.h"
#include "daemon/execution/cell_devices.h"
#include "drivers/driver_error.h"
#include "sampling/base/angles.h"

/// What is done with a cell before a daemon drives it: look at the devices, and move one axis by a small step.
namespace hilbrush {
namespace {

using Json = nlohmann::ordered_json;

/// What was found at one device, and what is wrong with it.
struct Finding {
  std::string device, driver;
  std::vector<std::string> found, problems;
};

std::string in_people_units(int axis, double value) {
  char text[60];
  std::snprintf(text, sizeof text, axis == kJ3 ? "%.3f mm" : "%.4f degrees",
                axis == kJ3 ? value * 1e3 : value / kDegree);
  return text;
}

/// `first`: the group's first among the cell's six axes.
template <std::size_t N>
void look_at_axes(AxisGroup<N>& axes, int first, const CellDescription& cell,
                  const std::function<std::vector<std::string>()>& identify, Finding& finding) {
  axes.connect();
  finding.found = identify();
  const auto status = axes.status();
  if (status.state == DeviceState::kFault) finding.problems.push_back(status.fault);
  for (std::size_t i = 0; i < N; ++i) {
    const int axis = first + static_cast<int>(i);
    const AxisDescription& limits = cell.axes[static_cast<std::size_t>(axis)];
    const std::string at = std::string(kAxisNames[static_cast<std::size_t>(axis)]) + " is at " +
                           in_people_units(axis, status.positions[i]);
    finding.found.push_back(at);
    if (!(status.positions[i] >= limits.min && status.positions[i] <= limits.max))
      finding.problems.push_back(at + ", outside the cell file's limits " + in_people_units(axis, limits.min) + " to " +
                                 in_people_units(axis, limits.max) + ": wrong sign, offset or scale?");
  }
}

void look_at_laser(CellDevices& devices, const CellDescription& cell, Finding& finding) {
  Laser& laser = devices.cell().laser;
  laser.connect();
  finding.found = devices.identify_laser();
  const Laser::Limits device = devices.laser_device_limits();
  const auto& wanted = cell.laser;
  char text[200];
  std::snprintf(text, sizeof text, "the cell file wants %.4g to %.4g mW, the laser can do %.4g to %.4g mW",
                wanted.power_min_w * 1e3, wanted.power_max_w * 1e3, device.power_min_w * 1e3, device.power_max_w * 1e3);
  constexpr double kRounding = 1e-6;
  if (wanted.power_min_w < device.power_min_w * (1 - kRounding) ||
      wanted.power_max_w > device.power_max_w * (1 + kRounding))
    finding.problems.push_back(text);
  const Laser::Status status = laser.status();
  if (!status.interlock_closed) finding.problems.push_back("the interlock is open, or the key is out");
  if (status.state == DeviceState::kFault) finding.problems.push_back(status.fault);
  laser.disable();
}

Finding look_at(const char* device, const std::string& driver, const std::function<void(Finding&)>& look) {
  Finding finding{device, driver, {}, {}};
  if (driver == "simulated") return finding;
  try {
    look(finding);
  } catch (const DriverError& error) {
    finding.problems.push_back(error.what());
  }
  return finding;
}

std::vector<Finding> look_at_cell(CellDevices& devices, const CellDescription& description) {
  const Cell cell = devices.cell();
  const auto& drivers = description.devices;
  std::vector<Finding> findings;
  findings.push_back(look_at("robot", drivers.robot, [&](Finding& finding) {
    look_at_axes<4>(
        cell.robot, kJ1, description, [&] { return devices.identify_robot(); }, finding);
  }));
  findings.push_back(look_at("table", drivers.table, [&](Finding& finding) {
    look_at_axes<2>(
        cell.table, kTilt, description, [&] { return devices.identify_table(); }, finding);
  }));
  findings.push_back(
      look_at("laser", drivers.laser, [&](Finding& finding) { look_at_laser(devices, description, finding); }));
  return findings;
}

void print(const CommandContext& context, const CellDescription& cell, const std::vector<Finding>& findings) {
  std::ostream& out = context.terminal.out;
  if (context.is_json) {
    Json devices;
    for (const Finding& finding : findings)
      devices[finding.device] = {{"driver", finding.driver},
                                 {"fit", finding.problems.empty()},
                                 {"found", finding.found},
                                 {"problems", finding.problems}};
    out << Json{{"cell", cell.name}, {"devices", devices}}.dump(-1, ' ', false, Json::error_handler_t::replace) << '\n';
    return;
  }
  for (const Finding& finding : findings) {
    const char* verdict = finding.driver == "simulated" ? "nothing to check"
                          : finding.problems.empty()    ? "fit"
                                                        : "NOT FIT";
    out << finding.device << " (" << finding.driver << "): " << verdict << '\n';
    for (const std::string& line : finding.found) out << "  " << printable(line) << '\n';
    for (const std::string& problem : finding.problems) out << "  ! " << printable(problem) << '\n';
  }
}

int check_cell(const CommandContext& context, const std::string& name) {
  const std::filesystem::path file = find_cell(name);
  const CellDescription description = load_cell(file);
  const auto devices = make_cell_devices(description, file);
  const std::vector<Finding> findings = look_at_cell(*devices, description);
  print(context, description, findings);
  const bool is_fit =
      std::all_of(findings.begin(), findings.end(), [](const Finding& finding) { return finding.problems.empty(); });
  return is_fit ? kExitOk : kExitRefused;
}

struct JogFlags {
  std::string axis, cell = "default";
  std::optional<double> by_deg, by_mm;
  bool is_confirmed = false;
};

constexpr double kStepMaxDeg = 15, kStepMaxMm = 20;
constexpr double kSlow = 0.05;  ///< share of the cell file's speeds
constexpr int kSlowPercent = 5;
constexpr double kSettleS = 0.2;

/// The same devices, slow; an axis that would search its reference is left where it is.
CellDeviceOptions slowed(CellDeviceOptions options) {
  const auto slow = [](auto& axes) {
    for (ModbusAxisOptions& axis : axes) {
      axis.bounds.speed_max *= kSlow;
      axis.bounds.acceleration_max *= kSlow;
      axis.homes_to_zero = false;
    }
  };
  if (auto* dobot = std::get_if<DobotOptions>(&options.robot)) dobot->speed_percent = kSlowPercent;
  if (auto* axes = std::get_if<ModbusGroupOptions<4>>(&options.robot)) slow(axes->axes);
  if (auto* axes = std::get_if<ModbusGroupOptions<2>>(&options.table)) slow(axes->axes);
  return options;
}

int axis_index(const std::string& name) {
  const auto found = std::find(kAxisNames.begin(), kAxisNames.end(), name);
  return static_cast<int>(found - kAxisNames.begin());
}

double step_of(const JogFlags& flags, int axis) {
  const bool is_linear = axis == kJ3;
  if (is_linear != flags.by_mm.has_value() || is_linear == flags.by_deg.has_value())
    throw InputError(
        is_linear ? "--by-mm" : "--by-deg",
        "axis " + flags.axis + " moves by " + (is_linear ? "millimeters" : "degrees") + ": give this and nothing else");
  const double step = is_linear ? *flags.by_mm : *flags.by_deg, limit = is_linear ? kStepMaxMm : kStepMaxDeg;
  if (!(std::abs(step) <= limit) || step == 0)
    throw InputError(is_linear ? "--by-mm" : "--by-deg",
                     "a step is at most " + std::to_string(static_cast<int>(limit)));
  return is_linear ? step * 1e-3 : step * kDegree;
}

bool is_agreed(const CommandContext& context, const JogFlags& flags, const std::string& question) {
  if (flags.is_confirmed) return true;
  if (!context.terminal.in_is_terminal) return false;
  context.terminal.err << question << " [y/N] " << std::flush;
  std::string answer;
  std::getline(context.terminal.in, answer);
  return answer == "y" || answer == "yes";
}

/// `index`: of the axis in its group.
template <std::size_t N>
int jog_axes(const CommandContext& context, const JogFlags& flags, AxisGroup<N>& axes, std::size_t index, double step,
             Clock& clock, InterruptWatch& interrupt) {
  const int axis = axis_index(flags.axis);
  axes.connect();
  auto target = axes.status().positions;
  const double from = target[index];
  target[index] += step;
  if (!is_agreed(context, flags,
                 "Move " + flags.axis + " from " + in_people_units(axis, from) + " to " +
                     in_people_units(axis, target[index]) + ", slowly, the laser off. Is everybody clear?")) {
    context.terminal.err << "hilbrush: nothing was moved; answer y, or give --yes\n";
    return kExitRefused;
  }
  axes.enable();
  axes.home();
  axes.move_to(target, kSettleS);
  const double deadline_s = clock.now_s() + 60;
  for (;;) {
    const auto status = axes.status();
    const bool is_late = clock.now_s() > deadline_s, is_interrupted = interrupt.take();
    if (!status.in_position && status.state != DeviceState::kFault && !is_late && !is_interrupted) {
      clock.sleep_until(clock.now_s() + 0.02);
      continue;
    }
    axes.disable();
    if (is_interrupted) throw Interrupted{"the axis was stopped"};
    if (status.state == DeviceState::kFault) throw DriverError(status.fault);
    if (is_late) throw DriverError("the axis is not in position after a minute; it was stopped");
    if (context.is_json)
      context.terminal.out << Json{{"axis", flags.axis},
                                   {"from", axis == kJ3 ? from * 1e3 : from / kDegree},
                                   {"to",
                                    axis == kJ3 ? status.positions[index] * 1e3 : status.positions[index] / kDegree}}
                                  .dump()
                           << '\n';
    else
      context.terminal.out << flags.axis << " is at " << in_people_units(axis, status.positions[index]) << '\n';
    return kExitOk;
  }
}

int jog(const CommandContext& context, const JogFlags& flags) {
  const int axis = axis_index(flags.axis);
  const double step = step_of(flags, axis);
  InterruptWatch interrupt;  // before the devices' threads
  const std::filesystem::path file = find_cell(flags.cell);
  const CellDescription description = load_cell(file);
  const auto devices = make_cell_devices(description, slowed(load_cell_devices(file)), file);
  const Cell cell = devices->cell();
  cell.laser.connect();  // which turns emission off and gate shut, or fails
  cell.laser.disable();
  return axis < kTilt
             ? jog_axes<4>(context, flags, cell.robot, static_cast<std::size_t>(axis), step, cell.clock, interrupt)
             : jog_axes<2>(context, flags, cell.table, static_cast<std::size_t>(axis - kTilt), step, cell.clock,
                           interrupt);
}

}  // namespace

void add_commissioning_commands(CLI::App& app, CommandContext& context) {
  auto name = std::make_shared<std::string>("default");
  CLI::App* check = add_command(app, context, "check-cell",
                                "connect a cell's devices, say what they are and whether they are fit; moves nothing");
  check->add_option("CELL", *name, "name of a cell, or its file")->capture_default_str();
  check->callback([&context, name] { context.action = [&context, name] { return check_cell(context, *name); }; });

  auto flags = std::make_shared<JogFlags>();
  CLI::App* command =
      add_command(app, context, "jog", "move one axis by a small step, slowly, the laser off; for commissioning");
  command->add_option("AXIS", flags->axis, "j1, j2, j3, j4, a or c")
      ->required()
      ->check(CLI::IsMember(std::vector<std::string>(kAxisNames.begin(), kAxisNames.end())));
  command->add_option("--by-deg", flags->by_deg, "step of an axis that turns, at most 15 degrees");
  command->add_option("--by-mm", flags->by_mm, "step of j3, at most 20 mm");
  command->add_option("--cell", flags->cell, "name of a cell, or its file")->capture_default_str();
  command->add_flag("--yes", flags->is_confirmed, "don't ask");
  command->callback([&context, flags] { context.action = [&context, flags] { return jog(context, *flags); }; });
}

}  // namespace hilbrush
