#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "config/cell_devices.h"
#include "drivers/cell.h"
#include "planner/cell_model/cell_description.h"
#include "sampling/base/input_error.h"

/// The devices that a cell file names, and what only simulated ones can do.
namespace hilbrush {

class CellDevices {
 public:
  virtual ~CellDevices() = default;
  virtual Cell cell() = 0;
  virtual bool is_simulated() const = 0;
  /// From now on simulated devices append what they emit to this file; an empty path: nowhere. Real devices
  /// have no such record. Executor's thread, between runs. @throws std::runtime_error naming the file.
  virtual void record_emissions(const std::filesystem::path& file) = 0;
  /// How each device identifies itself, for people, once connected. @throws DriverError
  virtual std::vector<std::string> identify_robot() { return {"simulated"}; }
  virtual std::vector<std::string> identify_table() { return {"simulated"}; }
  virtual std::vector<std::string> identify_laser() { return {"simulated"}; }
  /// What the connected laser itself can do; limits() of the laser are those of the cell file.
  virtual Laser::Limits laser_device_limits() { return cell().laser.limits(); }
};

/// Another process drives the cell's devices.
struct CellHeld : InputError {
  using InputError::InputError;
};

/// Nothing is connected yet. The clock runs at the description's time_scale; a cell with any real device has
/// no virtual time, there 0 means real time. Real devices are held by a lock on the cell's file while this
/// lives.
/// @throws InputError if the file's devices cannot be read; CellHeld if another process holds them.
std::unique_ptr<CellDevices> make_cell_devices(const CellDescription& description,
                                               const std::filesystem::path& cell_file);
/// The same with devices that differ from the file's: slower, for commissioning.
std::unique_ptr<CellDevices> make_cell_devices(const CellDescription& description,
                                               const CellDeviceOptions& options,
                                               const std::filesystem::path& cell_file);

}  // namespace hilbrush
