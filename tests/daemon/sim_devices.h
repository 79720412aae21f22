#pragma once
#include <filesystem>
#include <memory>

#include "daemon/server/cell_devices.h"
#include "sim/devices/sim_cell.h"

/// The simulated cell as a daemon's devices, within the test's reach.
namespace hilbrush::test {

class SimDevices final : public CellDevices {
 public:
  explicit SimDevices(const CellDescription& description) : sim(description, {.laser_start_delay_s = 0}) {}
  Cell cell() override { return sim.cell(); }
  bool is_simulated() const override { return true; }
  void record_emissions(const std::filesystem::path& file) override {
    sim.set_emission_sink({});
    record_.reset();
    if (file.empty()) return;
    record_ = std::make_unique<EmissionRecordFile>(file);
    sim.set_emission_sink([this](const Emission& emission) { record_->append(emission); });
  }

 private:
  std::unique_ptr<EmissionRecordFile> record_;  // outlives the cell, whose laser may still end a pulse

 public:
  SimCell sim;
};

}  // namespace hilbrush::test
