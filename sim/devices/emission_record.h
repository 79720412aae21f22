#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "planner/cell_model/cell_description.h"

/// What the simulated laser really emitted, from where. Kept by the simulated devices, not by the controller:
/// it is the witness.
namespace hilbrush {

struct Emission {
  Joints joints{};      ///< true joint values when the pulse began
  double start_s = 0;   ///< on the cell's clock
  double length_s = 0;  ///< true length: shorter than commanded if cut off
  double commanded_s = 0;
  double power_w = 0;
  bool is_moving = false;  ///< some axis was moving or not settled at some time of the pulse: a safety fault
};

/// Called by the simulated laser once for each emission, when it has ended; from the thread that ends it,
/// under the cell's lock (it must not call the cell). A pulse that ends by itself is handed over at the next
/// call to the laser or move of an axis.
using EmissionSink = std::function<void(const Emission&)>;

/// A growing file of emissions: a text header that describes the records as PLY would (without a count, which
/// could not be kept right), then fixed-size little-endian records, each with a CRC-32 of its own bytes.
/// Readable whatever instant the writer died. One thread.
class EmissionRecordFile {
 public:
  /// Opens for appending, creates if absent; a torn last record is cut off first. @throws std::runtime_error
  /// naming the file.
  explicit EmissionRecordFile(const std::filesystem::path& file);
  ~EmissionRecordFile();
  EmissionRecordFile(const EmissionRecordFile&) = delete;
  EmissionRecordFile& operator=(const EmissionRecordFile&) = delete;
  /// One write to the system, so that a killed process loses nothing. @throws std::runtime_error naming the
  /// file.
  void append(const Emission& emission);

 private:
  std::filesystem::path file_;
  int fd_ = -1;
  std::size_t whole_bytes_ = 0;
};

/// A torn last record is dropped. @throws std::runtime_error naming the file if it cannot be read, is not an
/// emission record, or is damaged anywhere but at its end.
std::vector<Emission> read_emission_record(const std::filesystem::path& file);

}  // namespace hilbrush
