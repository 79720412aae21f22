#include "planner/plan.h"

#include <algorithm>
#include <string>

#include "planner/cell_model/dose.h"
#include "planner/poses/follow_normal.h"
#include "planner/poses/pose_search.h"
#include "planner/poses/posed_dots.h"
#include "planner/poses/program_builder.h"
#include "planner/reach/transit.h"
#include "sampling/base/check.h"
#include "sampling/base/input_error.h"

namespace hilbrush {
namespace {

/// The dots that the laser has the energy for; the others are skipped.
std::vector<std::uint32_t> dots_with_energy(const CellDescription& cell, const DotSequence& dots,
                                            std::vector<SkippedDot>& skipped) {
  std::vector<std::uint32_t> indices;
  indices.reserve(dots.dots.size());
  for (std::uint32_t i = 0; i < dots.dots.size(); ++i) {
    DoseResult result = find_dose(cell, dots.pitch_m, dots.dots[i].level);
    if (result.dose)
      indices.push_back(i);
    else
      skipped.push_back(
          {i, SkipReason::kEnergy, std::move(result.refusal), "the laser cannot deliver the energy"});
  }
  return indices;
}

}  // namespace

Plan plan_exposures(const Reach& reach, const DotSequence& dots, const Progress& progress) {
  Plan plan;
  plan.program.pitch_m = dots.pitch_m;
  const std::vector<std::uint32_t> dot_indices = dots_with_energy(reach.cell(), dots, plan.skipped);
  const Progress search_progress = progress.part(0, .8);
  PosedDots posed = reach.options().policy == PosePolicy::kFollowNormal
                        ? follow_normal(reach, dots, dot_indices, search_progress)
                        : search_poses(reach, dots, dot_indices, search_progress);
  for (SkippedDot& skipped : posed.skipped) plan.skipped.push_back(std::move(skipped));

  build_program(reach, dots, posed, plan.program, plan.skipped, progress.part(.8, 1));
  std::stable_sort(plan.skipped.begin(), plan.skipped.end(),
                   [](const SkippedDot& a, const SkippedDot& b) { return a.dot_index < b.dot_index; });
  CHECK_EQ(plan.program.exposures.size() + plan.skipped.size(), dots.dots.size());
  plan.time = estimate_time(reach.cell(), plan.program);
  progress(1);
  return plan;
}

std::vector<Joints> plan_approach(const Reach& reach, const ExposureProgram& program, std::size_t next,
                                  const Joints& from) {
  if (next >= program.exposures.size()) throw InputError("next", "the program has no such exposure");
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const AxisDescription& axis = reach.cell().axes[i];
    if (!(from[i] >= axis.min - 1e-6 && from[i] <= axis.max + 1e-6))
      throw InputError("from", std::string("the joint ") + kAxisNames[i] + " is outside its limits");
  }
  const auto path = Transit(reach).route_by_search(from, program.exposures[next].joints);
  if (!path)
    throw InputError("from", "no clear path leads to exposure " + std::to_string(next) +
                                 ": jog the arm clear of the object, then try again");
  return *path;
}

}  // namespace hilbrush
