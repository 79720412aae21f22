#pragma once
#include "planner/poses/posed_dots.h"
#include "sampling/base/progress.h"

/// Poses to program: the moves between them are proven clear or led around by way-points, doses are added.
namespace hilbrush {

/// Appends to `plan`: exposures, way-points (home first and last), and the dots that no clear way leads to. Ways are
/// looked for in parallel, each between two given poses; the result is the same for any number of threads.
/// Memory: O(1) beside the plan and `posed`.
void build_program(const Reach::Implementation& reach, const DotSequence& dots, const PosedDots& posed, Plan& plan,
                   const Progress& progress = {});

}  // namespace hilbrush
