#pragma once
#include <atomic>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "daemon/journal.h"
#include "drivers/cell.h"
#include "planner/exposure_program.h"

/// Runs an exposure program on a cell: the only code that commands motion. One exposure: vias, move, in position and settled on both chains,
/// journal armed, pulse, laser proved off, journal done. The laser is off before every move, and on every way out.
namespace hilbrush {

/// How other threads reach a running executor. request_stop() also has the laser turned off and the axes stopped by the caller, at once.
struct ExecutionControl {
  std::atomic<bool> stop{false};   ///< latched by the owner
  std::atomic<bool> pause{false};  ///< ends between two exposures
};

enum class ExecutionOutcome { kFinished, kPaused, kStopped, kFailed };

struct ExecutionResult {
  ExecutionOutcome outcome = ExecutionOutcome::kFinished;
  std::string reason;       ///< a sentence when stopped or failed
  double elapsed_s = 0;     ///< on the cell's clock
  std::size_t exposed = 0;  ///< in this run
};

using ExecutionProgress = std::function<void(std::size_t exposures_done)>;

/// Connects nothing: the devices must be ready and the laser enabled. `approach`: way-points before the first exposure still to make, replacing
/// the program's vias there. Exposures whose journal state is not kRemaining are passed over. Never throws.
ExecutionResult execute(const ExposureProgram& program, const std::vector<Joints>& approach, const Cell& cell, const CellDescription& description,
                        Journal& journal, ExecutionControl& control, const ExecutionProgress& progress = {});

}  // namespace hilbrush
