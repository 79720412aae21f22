#include "daemon/server/cell_devices.h"

#include "sampling/input_error.h"
#include "sim/devices/sim_cell.h"

namespace hilbrush {
namespace {

class SimulatedDevices final : public CellDevices {
 public:
  explicit SimulatedDevices(const CellDescription& description) : sim_(description) {}
  Cell cell() override { return sim_.cell(); }
  bool is_simulated() const override { return true; }
  void record_emissions(const std::filesystem::path& file) override {
    sim_.set_emission_sink({});
    record_.reset();
    if (file.empty()) return;
    record_ = std::make_unique<EmissionRecordFile>(file);
    sim_.set_emission_sink([this](const Emission& emission) { record_->append(emission); });
  }

 private:
  std::unique_ptr<EmissionRecordFile> record_;  // outlives the cell, whose laser may still end a pulse
  SimCell sim_;
};

}  // namespace

std::unique_ptr<CellDevices> make_cell_devices(const CellDescription& description) {
  const auto& devices = description.devices;
  for (const auto& [key, driver] :
       {std::pair{"robot", devices.robot}, std::pair{"table", devices.table}, std::pair{"laser", devices.laser}})
    if (driver != "simulated")
      throw InputError(std::string("$.devices.") + key, "no driver is called \"" + driver + "\"; known: simulated");
  return std::make_unique<SimulatedDevices>(description);
}

}  // namespace hilbrush
