#pragma once
#include <cstddef>
#include <vector>

#include "planner/cell_model/exposure_program.h"
#include "planner/cell_model/program_time.h"
#include "planner/reach/reach.h"
#include "planner/reach/skipped_dot.h"
#include "sampling/base/progress.h"
#include "sampling/dots/dots.h"

/// Dots to program, the entry of planner/:
///   pose_search (shared beam directions, stations, unserved dots with reach's reasons, ordering, yaw) or
///   follow_normal (the baseline) -> program_builder (clear paths between poses: transit; dose) ->
///   program_time.
namespace hilbrush {

struct Plan {
  ExposureProgram program;          ///< provenance is filled in by the caller
  std::vector<SkippedDot> skipped;  ///< exposures.size() + skipped.size() == dots.size()
  TimeSplit time;
};

/// Cost: O(dots), memory O(dots).
Plan plan_exposures(const Reach& reach, const DotSequence& dots, const Progress& progress = {});

/// The checked path from measured joints to exposure `next` of the program: way-points, possibly none (the
/// direct move is clear).
/// @throws InputError if there is no clear path.
std::vector<Joints> plan_approach(const Reach& reach, const ExposureProgram& program, std::size_t next,
                                  const Joints& from);

}  // namespace hilbrush
