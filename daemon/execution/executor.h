#pragma once
#include <atomic>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "daemon/execution/duration_histogram.h"
#include "daemon/execution/journal.h"
#include "daemon/execution/motion_times.h"
#include "drivers/cell.h"
#include "planner/cell_model/exposure_program.h"

/// Runs an exposure program on a cell: the only code that commands motion. One exposure: vias, move, in
/// position and settled on both chains (by their report and by their measured positions), journal armed,
/// pulse, laser verified off, journal done. The laser is off before every move, and on every way out.
/// Waypoints are handed ahead to devices that can buffer them, pulses never; while a pulse is on, the next
/// set-points go ahead without what starts a move, so that nothing moves; while the axes move, the journal's
/// next window goes to disk and the laser is set to its next power.
namespace hilbrush {

/// How other threads reach a running executor; request_stop() sets `stop` and acts on the devices at once.
struct ExecutionControl {
  std::atomic<bool> stop{false};   ///< latched by the owner
  std::atomic<bool> pause{false};  ///< ends between two exposures
};

enum class ExecutionOutcome { kFinished, kPaused, kStopped, kFailed };

struct ExecutionResult {
  ExecutionOutcome outcome = ExecutionOutcome::kFinished;
  std::string reason;  ///< a sentence when stopped or failed
  /// Failed because the program asks for something that the cell must not do; nothing is wrong with the cell.
  bool is_program_at_fault = false;
  double elapsed_s = 0;     ///< on the cell's clock
  std::size_t exposed = 0;  ///< in this run
  /// What this program adds to each dot on the cell's clock: from when the devices are seen in position to
  /// the call that fires, and from when the pulse is seen over to the call that moves. Where a device reports
  /// since when, that time is used.
  DurationHistogram own_time{};
  /// What the devices took for the moves to exposures.
  MotionTimes motion{};
};

using ExecutionProgress = std::function<void(std::size_t exposures_done)>;

/// Connects nothing: the devices must be ready and the laser enabled. `approach`: waypoints before the first
/// exposure still to make, replacing the program's vias there; ignored if none is left. Exposures whose
/// journal state is not kRemaining are not exposed; those between two that are get their poses visited in the
/// dark, because only the path through them was checked. Limits of every pose, power and pulse are checked
/// again here. Virtual time: about a microsecond an exposure on top of the devices'. Executor's thread only.
/// Never throws.
ExecutionResult execute(const ExposureProgram& program, const std::vector<Joints>& approach, const Cell& cell,
                        const CellDescription& description, Journal& journal, ExecutionControl& control,
                        const ExecutionProgress& progress = {});

/// Moves through waypoints in the dark, as the operator ordered (homing); the laser needs not be armed.
/// Progress of nothing: no exposure is made. Executor's thread only. Never throws.
ExecutionResult travel(const std::vector<Joints>& path, const Cell& cell, const CellDescription& description,
                       ExecutionControl& control);

/// All devices from disconnected to ready, the laser armed; a device that is further on stays as it is. For
/// dry runs and tests: on a real cell these are separate acts of the operator. @throws DriverError
void bring_up(const Cell& cell);

/// Stops whatever runs, from any thread, in this order: the flag (so that no new pulse is begun), the gate
/// off, emission disabled (so that a pulse that was just being ordered is refused), the axes, the executor's
/// sleep. Idempotent, never throws.
/// @return true if the laser confirmed that it is off.
bool request_stop(const Cell& cell, ExecutionControl& control) noexcept;

}  // namespace hilbrush
