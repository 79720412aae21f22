#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <functional>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "config/cell_devices.h"
#include "config/cell_file.h"
#include "daemon/commands/command_context.h"
#include "daemon/commands/exit_code.h"
#include "daemon/commands/interrupt.h"
#include "daemon/execution/cell_devices.h"
#include "drivers/driver_error.h"
#include "sampling/base/angles.h"

/// Commands for a cell that no daemon drives yet: check its devices, and move one axis by a small step.
namespace hilbrush {
namespace {

using Json = nlohmann::ordered_json;

/// What was found at one device, and what is wrong with it.
struct Finding {
  std::string device, driver;
  std::vector<std::string> found, problems;
};

/// A position in millimeters or degrees.
std::string position_text(std::size_t axis, double value) {
  return axis == kJ3 ? fmt::format("{:.3f} mm", value * 1e3) : fmt::format("{:.4f} degrees", value / kDegree);
}

/// `first`: index of the group's first axis among the cell's six axes.
template <std::size_t N>
void check_axes(AxisGroup<N>& axes, std::size_t first, const CellDescription& cell,
                const std::function<std::vector<std::string>()>& identify, Finding& finding) {
  axes.connect();
  finding.found = identify();
  const auto status = axes.status();
  if (status.state == DeviceState::kFault) finding.problems.push_back(status.fault);
  for (std::size_t i = 0; i < N; ++i) {
    const std::size_t axis = first + i;
    const AxisDescription& limits = cell.axes[axis];
    const std::string at =
        std::string(kAxisNames[axis]) + " is at " + position_text(axis, status.positions[i]);
    finding.found.push_back(at);
    if (!(status.positions[i] >= limits.min && status.positions[i] <= limits.max))
      finding.problems.push_back(at + ", outside the cell file's limits " + position_text(axis, limits.min) +
                                 " to " + position_text(axis, limits.max) + ": wrong sign, offset or scale?");
  }
}

void check_laser(CellDevices& devices, const CellDescription& cell, Finding& finding) {
  Laser& laser = devices.cell().laser;
  laser.connect();
  finding.found = devices.identify_laser();
  const Laser::Limits device = devices.laser_device_limits();
  const auto& wanted = cell.laser;
  constexpr double kRounding = 1e-6;  // as a share; devices report their limits as decimal text
  if (wanted.power_min_w < device.power_min_w * (1 - kRounding) ||
      wanted.power_max_w > device.power_max_w * (1 + kRounding))
    finding.problems.push_back(
        fmt::format("the cell file says {:.4g} to {:.4g} mW, the laser can do {:.4g} to {:.4g} mW",
                    wanted.power_min_w * 1e3, wanted.power_max_w * 1e3, device.power_min_w * 1e3,
                    device.power_max_w * 1e3));
  const Laser::Status status = laser.status();
  if (!status.interlock_closed) finding.problems.push_back("the interlock is open, or the key is out");
  if (status.state == DeviceState::kFault) finding.problems.push_back(status.fault);
  laser.disable();
}

Finding check_device(const char* device, const std::string& driver,
                     const std::function<void(Finding&)>& check) {
  Finding finding{device, driver, {}, {}};
  if (driver == "simulated") return finding;
  try {
    check(finding);
  } catch (const DriverError& error) {
    finding.problems.push_back(error.what());
  }
  return finding;
}

std::vector<Finding> check_devices(CellDevices& devices, const DriverNames& drivers,
                                   const CellDescription& description) {
  const Cell cell = devices.cell();
  std::vector<Finding> findings;
  findings.push_back(check_device("robot", drivers.robot, [&](Finding& finding) {
    check_axes<4>(
        cell.robot, kJ1, description, [&] { return devices.identify_robot(); }, finding);
  }));
  findings.push_back(check_device("table", drivers.table, [&](Finding& finding) {
    check_axes<2>(
        cell.table, kTilt, description, [&] { return devices.identify_table(); }, finding);
  }));
  findings.push_back(check_device("laser", drivers.laser,
                                  [&](Finding& finding) { check_laser(devices, description, finding); }));
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
    out << Json{{"cell", cell.name}, {"devices", devices}}.dump(-1, ' ', false,
                                                                Json::error_handler_t::replace)
        << '\n';
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
  const CellDeviceOptions options = load_cell_devices(file);
  const auto devices = make_cell_devices(description, options, file);
  const std::vector<Finding> findings = check_devices(*devices, driver_names(options), description);
  print(context, description, findings);
  const bool is_fit = std::all_of(findings.begin(), findings.end(),
                                  [](const Finding& finding) { return finding.problems.empty(); });
  return is_fit ? kExitOk : kExitRefused;
}

struct JogFlags {
  std::string axis, cell = "default";
  std::optional<double> by_deg, by_mm;
  bool is_confirmed = false;
};

// Small enough to stop by hand what goes the wrong way, large enough to see which way it goes.
constexpr double kMaxStepDeg = 15;
constexpr double kMaxStepMm = 20;
constexpr double kJogSpeedShare = 0.05;  ///< of the speeds and accelerations in the cell file
constexpr int kJogSpeedPercent = 5;      ///< the same for a Dobot, which takes whole percent
constexpr double kSettleS = 0.2;
constexpr double kMoveTimeoutS = 60;
constexpr double kPollS = 0.02;

/// The same devices, slow. An axis that homes by a reference run does not home.
CellDeviceOptions slowed(CellDeviceOptions options) {
  const auto slow = [](auto& axes) {
    for (ModbusAxisOptions& axis : axes) {
      axis.bounds.speed_max *= kJogSpeedShare;
      axis.bounds.acceleration_max *= kJogSpeedShare;
      axis.homes_to_zero = false;
    }
  };
  if (auto* dobot = std::get_if<DobotOptions>(&options.robot)) dobot->speed_percent = kJogSpeedPercent;
  if (auto* axes = std::get_if<ModbusGroupOptions<4>>(&options.robot)) slow(axes->axes);
  if (auto* axes = std::get_if<ModbusGroupOptions<2>>(&options.table)) slow(axes->axes);
  return options;
}

std::size_t axis_index(const std::string& name) {
  const auto found = std::find(kAxisNames.begin(), kAxisNames.end(), name);
  return static_cast<std::size_t>(found - kAxisNames.begin());
}

double step_of(const JogFlags& flags, std::size_t axis) {
  const bool is_linear = axis == kJ3;
  if (is_linear != flags.by_mm.has_value() || is_linear == flags.by_deg.has_value())
    throw InputError(is_linear ? "--by-mm" : "--by-deg", "axis " + flags.axis + " moves by " +
                                                             (is_linear ? "millimeters" : "degrees") +
                                                             ": give this flag only");
  const double step = is_linear ? *flags.by_mm : *flags.by_deg;
  const double limit = is_linear ? kMaxStepMm : kMaxStepDeg;
  if (!(std::abs(step) <= limit) || step == 0)
    throw InputError(is_linear ? "--by-mm" : "--by-deg",
                     "a step is at most " + std::to_string(static_cast<int>(limit)));
  return is_linear ? step * 1e-3 : step * kDegree;
}

/// A flag, or a question on a terminal.
bool is_move_confirmed(const CommandContext& context, const JogFlags& flags, const std::string& question) {
  if (flags.is_confirmed) return true;
  if (!context.terminal.in_is_terminal) return false;
  context.terminal.err << question << " [y/N] " << std::flush;
  std::string answer;
  std::getline(context.terminal.in, answer);
  return answer == "y" || answer == "yes";
}

/// Waits for the end of the move, disables the axes and returns the position reached; `index`: of the axis in
/// its group. @throws DriverError, Interrupted
template <std::size_t N>
double finish_move(AxisGroup<N>& axes, std::size_t index, Clock& clock, InterruptWatch& interrupt) {
  const double deadline_s = clock.now_s() + kMoveTimeoutS;
  for (;;) {
    const auto status = axes.status();
    const bool is_late = clock.now_s() > deadline_s;
    const bool is_interrupted = interrupt.take();
    if (!status.in_position && status.state != DeviceState::kFault && !is_late && !is_interrupted) {
      clock.sleep_until(clock.now_s() + kPollS);
      continue;
    }
    axes.disable();
    if (is_interrupted) throw Interrupted{"the axis was stopped"};
    if (status.state == DeviceState::kFault) throw DriverError(status.fault);
    if (is_late) throw DriverError("the axis is not in position after a minute; it was stopped");
    return status.positions[index];
  }
}

/// `index`: of the axis in its group.
template <std::size_t N>
int jog_axes(const CommandContext& context, const JogFlags& flags, AxisGroup<N>& axes, std::size_t index,
             double step, Clock& clock, InterruptWatch& interrupt) {
  const std::size_t axis = axis_index(flags.axis);
  axes.connect();
  auto target = axes.status().positions;
  const double from = target[index];
  target[index] += step;
  if (!is_move_confirmed(context, flags,
                         "Move " + flags.axis + " from " + position_text(axis, from) + " to " +
                             position_text(axis, target[index]) +
                             ", slowly, the laser off. Is the cell clear?")) {
    context.terminal.err << "hilbrush: nothing was moved; answer y, or give --yes\n";
    return kExitRefused;
  }
  axes.enable();
  axes.home();
  axes.move_to(target, kSettleS);
  const double to = finish_move(axes, index, clock, interrupt);
  const auto in_mm_or_deg = [axis](double value) { return axis == kJ3 ? value * 1e3 : value / kDegree; };
  if (context.is_json)
    context.terminal.out
        << Json{{"axis", flags.axis}, {"from", in_mm_or_deg(from)}, {"to", in_mm_or_deg(to)}}.dump() << '\n';
  else
    context.terminal.out << flags.axis << " is at " << position_text(axis, to) << '\n';
  return kExitOk;
}

int jog(const CommandContext& context, const JogFlags& flags) {
  const std::size_t axis = axis_index(flags.axis);
  const double step = step_of(flags, axis);
  InterruptWatch interrupt;  // before the devices' threads
  const std::filesystem::path file = find_cell(flags.cell);
  const CellDescription description = load_cell(file);
  const auto devices = make_cell_devices(description, slowed(load_cell_devices(file)), file);
  const Cell cell = devices->cell();
  cell.laser.connect();  // turns the emission off and closes the gate, or fails
  cell.laser.disable();
  return axis < kTilt ? jog_axes<4>(context, flags, cell.robot, axis, step, cell.clock, interrupt)
                      : jog_axes<2>(context, flags, cell.table, axis - kTilt, step, cell.clock, interrupt);
}

}  // namespace

void add_commissioning_commands(CLI::App& app, CommandContext& context) {
  auto name = std::make_shared<std::string>("default");
  CLI::App* check =
      add_command(app, context, "check-cell",
                  "connect to a cell's devices and check them against the cell file; moves nothing");
  check->add_option("CELL", *name, "name of a cell, or its file")->capture_default_str();
  check->callback(
      [&context, name] { context.action = [&context, name] { return check_cell(context, *name); }; });

  auto flags = std::make_shared<JogFlags>();
  CLI::App* command =
      add_command(app, context, "jog", "move one axis by a small step, slowly, laser off; for commissioning");
  command->add_option("AXIS", flags->axis, "j1, j2, j3, j4, a or c")
      ->required()
      ->check(CLI::IsMember(std::vector<std::string>(kAxisNames.begin(), kAxisNames.end())));
  command->add_option("--by-deg", flags->by_deg, "step of a rotary axis, at most 15 degrees");
  command->add_option("--by-mm", flags->by_mm, "step of j3, at most 20 mm");
  command->add_option("--cell", flags->cell, "name of a cell, or its file")->capture_default_str();
  command->add_flag("--yes", flags->is_confirmed, "do not ask for confirmation");
  command->callback(
      [&context, flags] { context.action = [&context, flags] { return jog(context, *flags); }; });
}

}  // namespace hilbrush
