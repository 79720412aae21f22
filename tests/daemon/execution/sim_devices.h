#pragma once
#include <filesystem>

#include "daemon/execution/cell_devices.h"
#include "sim/devices/emission_keeper.h"
#include "sim/devices/sim_cell.h"

/// The simulated cell as a daemon's devices, within the test's reach.
namespace hilbrush::test {

class SimDevices final : public CellDevices {
 public:
  explicit SimDevices(const CellDescription& description) : sim(description, {.laser_start_delay_s = 0}) {}
  Cell cell() override { return sim.cell(); }
  bool is_simulated() const override { return true; }
  void record_emissions(const std::filesystem::path& file) override { keeper_.record(sim, file); }

 private:
  EmissionKeeper keeper_;

 public:
  SimCell sim;
};

}  // namespace hilbrush::test
