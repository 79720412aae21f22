#include "tests/cell/wired_world.h"

#include <algorithm>
#include <chrono>
#include <random>
#include <stdexcept>
#include <thread>
#include <utility>

#include "config/cell_file.h"
#include "config/json_reader.h"
#include "config/wired_cell_file.h"
#include "drivers/driver_error.h"
#include "sim/devices/sim_cell.h"
#include "tests/daemon/execution/program_fixture.h"

namespace hilbrush::test {
namespace {

std::string shipped_text() {
  constexpr std::size_t kCellBytesMax = 1u << 20;
  return read_text_file(find_cell("default").string(), kCellBytesMax);
}

}  // namespace

CellDescription shipped_cell() {
  return cell_from_json(shipped_text(), "default");
}

WireOptions WiredWorld::quick(double time_scale, double start_delay_s) {
  WireOptions options;
  options.time_scale = time_scale;
  options.start_delay_s = start_delay_s;
  // Where time runs fast, what a busy machine may keep its threads waiting is long.
  constexpr double kBusyWallS = .1;
  if (time_scale < 1) options.notice_s = kBusyWallS / time_scale;
  return options;
}

WiredWorld::WiredWorld(const WireOptions& options, Drivers drivers)
    : wire_(shipped_cell(), options),
      cell_file_(
          folder_.write("cell.json", wired_cell_text(shipped_text(), wire_.endpoints(), options.time_scale))),
      description(load_cell(cell_file_)) {
  wire_.set_emission_sink([this](const Emission& emission) {
    const std::lock_guard lock(mutex_);
    emissions_.push_back(emission);
  });
  if (drivers == Drivers::kHere) reconnect();
}

void WiredWorld::reconnect() {
  devices_.reset();
  devices_ = make_cell_devices(description, cell_file_);
}

void WiredWorld::recover(ExecutionControl& control, int attempts) {
  control.stop = false;
  for (;;) {
    try {
      const Cell devices = cell();
      const auto clear = [](auto& device) {
        if (device.status().state == DeviceState::kFault) device.clear_fault();
      };
      clear(devices.laser);
      clear(devices.robot);
      clear(devices.table);
      bring_up(devices);
      return;
    } catch (const DriverError&) {
      if (--attempts <= 0) throw;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }
}

std::vector<Emission> WiredWorld::emissions() const {
  const std::lock_guard lock(mutex_);
  return emissions_;
}

std::vector<Emission> WiredWorld::take_emissions() {
  const std::lock_guard lock(mutex_);
  return std::exchange(emissions_, {});
}

std::vector<Emission> painted_in_process(const ExposureProgram& program, CellDescription description) {
  description.simulation.time_scale = 0;
  SimCell sim(description);
  std::vector<Emission> emissions;
  sim.set_emission_sink([&](const Emission& emission) { emissions.push_back(emission); });
  bring_up(sim.cell());
  Journal journal = Journal::in_memory(program.exposures.size());
  ExecutionControl control;
  const ExecutionResult result = execute(program, {}, sim.cell(), description, journal, control);
  if (result.outcome != ExecutionOutcome::kFinished)
    throw std::runtime_error("the cell in process did not finish: " + result.reason);
  return emissions;
}

ExposureProgram small_job(const CellDescription& cell, std::size_t count, unsigned seed,
                          std::size_t table_every) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> step(-.004, .004);
  Joints home;
  for (std::size_t i = 0; i < kAxisCount; ++i) home[i] = cell.axes[i].home;
  ExposureProgram program;
  program.provenance = {std::string(64, 'a'), std::string(64, 'b'), cell.sha256, "test"};
  program.pitch_m = 254e-6;
  Joints at = home;
  at[kJ3] = .2;
  for (std::size_t i = 0; i < count; ++i) {
    if (i > 0 && i % table_every == 0) {
      at[kJ3] = .22;
      program.vias.push_back({static_cast<std::uint32_t>(i), at});
      at[kRotation] += .1 * (i / table_every % 2 == 0 ? 1 : -1);
      at[kTilt] = .02 * static_cast<double>(i / table_every % 5);
      program.vias.push_back({static_cast<std::uint32_t>(i), at});
      at[kJ3] = .2;
    }
    for (const std::size_t k : {kJ1, kJ2, kJ4})
      at[k] = std::clamp(at[k] + step(random), home[k] - .2, home[k] + .2);
    at[kJ3] = std::clamp(at[kJ3] + .1 * step(random), .15, .21);
    program.exposures.push_back(small_exposure(i, at));
  }
  program.vias.push_back({static_cast<std::uint32_t>(count), home});
  return program;
}

}  // namespace hilbrush::test
