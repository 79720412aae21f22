// hilbrush-simcell: a simulated robot cell that speaks the protocols of real devices, on TCP ports and
// pseudo-terminals, with faults by script. See sim/wire/wire_cell.h.

#include <fmt/core.h>
#include <signal.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <fstream>
#include <map>
#include <memory>
#include <optional>

#include "config/cell_file.h"
#include "config/fault_script_file.h"
#include "config/json_reader.h"
#include "config/wired_cell_file.h"
#include "sampling/base/input_error.h"
#include "sim/devices/emission_record.h"
#include "sim/wire/wire_cell.h"

namespace {

using hilbrush::WireCell;
using hilbrush::WireOptions;

enum ExitCode { kOk = 0, kInternal = 1, kUsage = 2, kBadInput = 3 };

struct Arguments {
  std::string cell = "default";
  std::string write_cell, faults, record;
  std::optional<hilbrush::Interpolation> interpolation;
  WireOptions wire;
};

void write_file(const std::string& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary | std::ios::trunc);
  if (!(out << text).flush()) throw std::runtime_error(file + ": cannot be written");
}

/// Call before any thread is started, so that all threads leave these signals to sigwait().
sigset_t block_ending_signals() {
  sigset_t signals;
  ::sigemptyset(&signals);
  for (const int number : {SIGTERM, SIGINT, SIGHUP}) ::sigaddset(&signals, number);
  ::pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  return signals;
}

void serve(Arguments arguments) {
  const sigset_t ending = block_ending_signals();
  const auto cell_file = hilbrush::find_cell(arguments.cell);
  constexpr std::size_t kCellBytesMax = 1u << 20;
  const std::string cell_text = hilbrush::read_text_file(cell_file.string(), kCellBytesMax);
  auto description = hilbrush::cell_from_json(cell_text, cell_file.string());
  if (arguments.interpolation) description.motion.robot = *arguments.interpolation;
  if (!arguments.faults.empty()) arguments.wire.faults = hilbrush::load_fault_script(arguments.faults);

  std::unique_ptr<hilbrush::EmissionRecordFile>
      record;  // outlives the cell, whose destructor may end a pulse
  if (!arguments.record.empty()) record = std::make_unique<hilbrush::EmissionRecordFile>(arguments.record);
  WireCell cell(description, arguments.wire);
  if (record) cell.set_emission_sink([&](const hilbrush::Emission& emission) { record->append(emission); });
  if (!arguments.write_cell.empty())
    write_file(arguments.write_cell,
               hilbrush::wired_cell_text(cell_text, cell.endpoints(), arguments.wire.time_scale));

  const auto& ends = cell.endpoints();
  fmt::print(
      "{{\"ready\":true,\"robot\":{{\"dashboard_port\":{},\"motion_port\":{},\"feedback_port\":{}}},"
      "\"table\":\"{}\","
      "\"laser\":\"{}\"}}\n",
      ends.dashboard_port, ends.motion_port, ends.feedback_port,
      ends.table_serial.empty() ? std::to_string(ends.table_tcp_port) : ends.table_serial, ends.laser_port);
  std::fflush(stdout);
  int number = 0;
  ::sigwait(&ending, &number);
}

void add_flags(CLI::App& app, Arguments& arguments) {
  WireOptions& wire = arguments.wire;
  using Table = WireOptions::Table;
  using LaserHead = WireOptions::LaserHead;
  const std::map<std::string, Table> tables{
      {"oriental-az", Table::kOrientalAz}, {"cia402", Table::kCia402}, {"leadshine-pr", Table::kLeadshinePr}};
  const std::map<std::string, LaserHead> lasers{{"obis", LaserHead::kObis}, {"cobolt", LaserHead::kCobolt}};
  app.add_option("--cell", arguments.cell, "name of a cell, or its file")->capture_default_str();
  app.add_option("--write-cell", arguments.write_cell,
                 "write the cell file here, with its devices replaced by drivers for this simulated cell");
  using hilbrush::Interpolation;
  const std::map<std::string, Interpolation> interpolations{{"independent", Interpolation::kIndependent},
                                                            {"coordinated", Interpolation::kCoordinated}};
  app.add_option(
         "--interpolation", arguments.interpolation,
         "how the robot leads its joints: independent or coordinated (default: as the cell file says; its "
         "table's drives are independent)")
      ->transform(CLI::CheckedTransformer(interpolations, CLI::ignore_case));
  app.add_option("--faults", arguments.faults, "fault script (JSON)");
  app.add_option("--record", arguments.record, "append every emission to this file");
  app.add_option("--time-scale", wire.time_scale, "wall seconds for one second of the cell")
      ->check(CLI::Range(1e-4, 1000.))
      ->capture_default_str();
  app.add_option("--table", wire.table, "oriental-az, cia402 or leadshine-pr")
      ->transform(CLI::CheckedTransformer(tables, CLI::ignore_case));
  app.add_flag("--table-serial", wire.is_table_serial,
               "Modbus RTU on a pseudo-terminal instead of Modbus TCP");
  app.add_option("--laser", wire.laser, "obis or cobolt")
      ->transform(CLI::CheckedTransformer(lasers, CLI::ignore_case));
  app.add_flag("--laser-serial", wire.is_laser_serial, "a pseudo-terminal instead of a TCP port");
  app.add_option("--start-delay-s", wire.start_delay_s, "seconds from enabling the laser to its emission")
      ->check(CLI::Range(0., 600.))
      ->capture_default_str();
  app.add_option("--warm-up-s", wire.warm_up_s, "seconds of the laser's warm-up, from the start")
      ->check(CLI::Range(0., 3600.))
      ->capture_default_str();
}

int report_failure(const std::exception& error, ExitCode code) {
  fmt::print(stderr, "hilbrush-simcell: {}\n", error.what());
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "A simulated robot cell that speaks the protocols of its devices on TCP ports and pseudo-terminals."};
  app.set_version_flag("--version", std::string("hilbrush-simcell ") + HILBRUSH_VERSION);
  Arguments arguments;
  add_flags(app, arguments);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kOk : kUsage;
  }
  try {
    serve(arguments);
    return kOk;
  } catch (const hilbrush::InputError& error) {
    return report_failure(error, kBadInput);
  } catch (const std::exception& error) {
    return report_failure(error, kInternal);
  }
}
