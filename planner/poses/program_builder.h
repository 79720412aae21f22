#pragma once
#include <vector>

#include "planner/cell_model/exposure_program.h"
#include "planner/poses/posed_dots.h"
#include "sampling/base/progress.h"

/// Poses to program: the moves between them are proven clear or get way-points around obstacles; doses are
/// added.
namespace hilbrush {

/// Appends exposures and way-points (home first and last) to `program`, and the dots that no clear path leads
/// to to `skipped`. Paths are found in parallel, each between two given poses; the result is the same for any
/// number of threads. Memory: O(1) beside the program and `posed`.
void build_program(const Reach& reach, const DotSequence& dots, const PosedDots& posed,
                   ExposureProgram& program, std::vector<SkippedDot>& skipped, const Progress& progress = {});

}  // namespace hilbrush
