#pragma once
#include <filesystem>
#include <memory>

#include "sim/devices/emission_record.h"
#include "sim/devices/sim_cell.h"

namespace hilbrush {

/// Where a simulated cell's emissions go. Outlives the cell, whose laser may still end a pulse.
class EmissionKeeper {
 public:
  /// From now on into this file; an empty path: nowhere. @throws std::runtime_error naming the file
  void record(SimCell& sim, const std::filesystem::path& file) {
    sim.set_emission_sink({});
    record_.reset();
    if (file.empty()) return;
    record_ = std::make_unique<EmissionRecordFile>(file);
    sim.set_emission_sink([this](const Emission& emission) { record_->append(emission); });
  }

 private:
  std::unique_ptr<EmissionRecordFile> record_;
};

}  // namespace hilbrush
