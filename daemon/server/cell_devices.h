#pragma once
#include <filesystem>
#include <memory>

#include "drivers/cell.h"
#include "planner/cell_description.h"

/// The devices that a cell file names, and what only simulated ones can do.
namespace hilbrush {

class CellDevices {
 public:
  virtual ~CellDevices() = default;
  virtual Cell cell() = 0;
  virtual bool is_simulated() const = 0;
  /// From now on simulated devices append what they emit to this file; an empty path: nowhere. Real devices have no
  /// such record. Executor's thread, between runs. @throws std::runtime_error naming the file.
  virtual void record_emissions(const std::filesystem::path& file) = 0;
};

/// @throws InputError if the description names devices that no driver knows.
std::unique_ptr<CellDevices> make_cell_devices(const CellDescription& description);

}  // namespace hilbrush
