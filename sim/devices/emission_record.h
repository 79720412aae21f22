#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "planner/cell_description.h"

/// What the simulated laser really emitted, from where. Kept by the simulated devices, not by the controller: it is the witness.
namespace hilbrush {

struct Emission {
  Joints joints{};          ///< true joint values when the pulse began
  double start_s = 0;       ///< on the cell's clock
  double length_s = 0;      ///< true length: shorter than commanded if cut off
  double commanded_s = 0;
  double power_w = 0;
  bool is_moving = false;   ///< some axis was moving or not settled: a safety fault
};

/// Called by the simulated laser once for each emission, when it has ended; from the thread that ends it, under the laser's lock.
using EmissionSink = std::function<void(const Emission&)>;

/// A growing file of emissions (binary PLY-like header, fixed-size records with checksums): readable whatever instant the writer died.
class EmissionRecordFile {
 public:
  /// Opens for appending, creates if absent. @throws std::runtime_error naming the file.
  explicit EmissionRecordFile(const std::filesystem::path& file);
  ~EmissionRecordFile();
  EmissionRecordFile(const EmissionRecordFile&) = delete;
  EmissionRecordFile& operator=(const EmissionRecordFile&) = delete;
  void append(const Emission& emission);

 private:
  int fd_ = -1;
};

/// A torn last record is dropped. @throws std::runtime_error naming the file.
std::vector<Emission> read_emission_record(const std::filesystem::path& file);

}  // namespace hilbrush
