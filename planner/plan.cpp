#include "planner/plan.h"

#include <algorithm>
#include <cmath>

#include "planner/cell_model/dose.h"
#include "planner/cell_model/time_model.h"
#include "planner/poses/follow_normal.h"
#include "planner/poses/pose_search.h"
#include "planner/poses/posed_dots.h"
#include "planner/poses/program_builder.h"
#include "planner/reach/reach.h"
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
    Dose dose;
    SkippedDot refusal{i, SkipReason::kEnergy, {}, "the laser cannot deliver the energy"};
    if (find_dose(cell, dots.pitch_m, dots.dots[i].level, dose, refusal.detail))
      indices.push_back(i);
    else
      skipped.push_back(std::move(refusal));
  }
  return indices;
}

}  // namespace

Plan plan_exposures(const Reach& reach, const DotSequence& dots, const Progress& progress) {
  const Reach::Implementation& implementation = reach.implementation();
  Plan plan;
  plan.program.pitch_m = dots.pitch_m;
  const std::vector<std::uint32_t> dot_indices = dots_with_energy(implementation.cell, dots, plan.skipped);
  const Progress search_progress = progress.part(0, .8);
  PosedDots posed = implementation.options.policy == PosePolicy::kFollowNormal
                        ? follow_normal(implementation, dots, dot_indices, search_progress)
                        : search_poses(implementation, dots, dot_indices, search_progress);
  for (SkippedDot& skipped : posed.skipped) plan.skipped.push_back(std::move(skipped));

  build_program(implementation, dots, posed, plan, progress.part(.8, 1));
  std::stable_sort(plan.skipped.begin(), plan.skipped.end(),
                   [](const SkippedDot& a, const SkippedDot& b) { return a.dot_index < b.dot_index; });
  CHECK_EQ(plan.program.exposures.size() + plan.skipped.size(), dots.dots.size());
  plan.time = estimate_time(implementation.cell, plan.program);
  progress(1);
  return plan;
}

TimeSplit estimate_time(const CellDescription& cell, const ExposureProgram& program, const TimeVisitor& visit) {
  TimeSplit time;
  Joints at = home_joints(cell);
  double ringing_s = 0;  // what passing a way-point without settling has left over, see Run::move of the executor
  const auto move_to = [&](const Joints& to, double& spent_s) {
    const double travel_s = move_s(cell, at, to);
    ringing_s = std::max(settle_s(cell, at, to), ringing_s - travel_s);
    spent_s += travel_s + cell.timing.message_s + cell.timing.move_delay_s;
    at = to;
  };
  std::size_t next_via = 0;
  for (std::size_t i = 0; i <= program.exposures.size(); ++i) {
    bool is_repose = false;
    for (; next_via < program.vias.size() && program.vias[next_via].before_exposure <= i; ++next_via) {
      move_to(program.vias[next_via].joints, time.retract_s);
      is_repose = true;
    }
    if (i == program.exposures.size()) break;
    const Exposure& exposure = program.exposures[i];
    move_to(exposure.joints, is_repose ? time.retract_s : time.move_s);
    time.settle_s += ringing_s;
    ringing_s = 0;
    time.expose_s += static_cast<double>(exposure.pulse_s) + cell.timing.message_s;
    if (visit) visit(i, time);
  }
  return time;
}

double least_time_s(const CellDescription& cell, const ExposureProgram& program) {
  double sum_s = 0;
  for (const Exposure& exposure : program.exposures)
    sum_s += cell.timing.settle_min_s + static_cast<double>(exposure.pulse_s) + cell.timing.tick_s;
  return sum_s;
}

std::vector<Joints> plan_approach(const Reach& reach, const ExposureProgram& program, std::size_t next,
                                  const Joints& from) {
  const Reach::Implementation& implementation = reach.implementation();
  if (next >= program.exposures.size()) throw InputError("next", "the program has no such exposure");
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const auto& axis = implementation.cell.axes[i];
    if (!(from[i] >= axis.min - 1e-6 && from[i] <= axis.max + 1e-6))
      throw InputError("from", std::string("the joint ") + kAxisNames[i] + " is outside its limits");
  }
  const auto way = Transit(implementation).route_by_search(from, program.exposures[next].joints);
  if (!way)
    throw InputError("from", "no clear way leads to exposure " + std::to_string(next) +
                                 ": jog the arm clear of the object, then ask again");
  return *way;
}

}  // namespace hilbrush
