#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "daemon/execution/cell_devices.h"
#include "daemon/execution/executor.h"
#include "sim/wire/wire_cell.h"
#include "tests/support/temporary_folder.h"

/// A whole cell on wires in one process: the real drivers, chosen by a cell file as the daemon would choose
/// them, against the simulated devices; nothing between them but sockets. And what the film's side saw of it.
namespace hilbrush::test {

class WiredWorld {
 public:
  /// kNone: the test drives the devices itself, by the cell file.
  enum class Drivers { kHere, kNone };
  /// The shipped cell on wires. @throws what the wire or the drivers throw
  explicit WiredWorld(const WireOptions& options, Drivers drivers = Drivers::kHere);
  static WireOptions quick(double time_scale, double start_delay_s = .1);

  /// New drivers, as after the daemon's restart; the devices stay as they are.
  void reconnect();
  /// Disconnected or in fault -> ready and armed: what an operator does with clear and arm. Tries again while
  /// a fault that was ordered still lasts. @throws DriverError
  void recover(ExecutionControl& control, int attempts = 1);
  Cell cell() { return devices_->cell(); }
  WireCell& wire() { return wire_; }
  std::vector<Emission> emissions() const;
  /// Those since the last call; they are forgotten.
  std::vector<Emission> take_emissions();
  const std::filesystem::path& cell_file() const { return cell_file_; }
  const testing_support::TemporaryFolder& folder() const { return folder_; }

 private:
  testing_support::TemporaryFolder folder_;
  WireCell wire_;
  std::filesystem::path cell_file_;

 public:
  const CellDescription description;  ///< of cell_file()

 private:
  mutable std::mutex mutex_;
  std::vector<Emission> emissions_;
  std::unique_ptr<CellDevices> devices_;
};

/// The shipped cell.
CellDescription shipped_cell();

/// What the same cell emits in process, under virtual time. @throws std::runtime_error if it does not finish
std::vector<Emission> painted_in_process(const ExposureProgram& program, CellDescription description);

/// A program for the shipped cell: small steps of the arm about its home, a table move every `table_every`
/// exposures with a way-point before it, a way home. Each exposure's joints are its own.
ExposureProgram small_job(const CellDescription& cell, std::size_t count, unsigned seed = 1,
                          std::size_t table_every = 20);

}  // namespace hilbrush::test
