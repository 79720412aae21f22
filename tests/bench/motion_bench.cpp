// How near lens and quill come to object, post and plate on the legs of a program, for every way in which the
// cell's controllers may lead their joints: each joint on its own or all together, the arm or the table late.
//   motion_bench PROGRAM.ply MODEL SIZE_MM [LATE_MS]
// Distances are found by the check's own geometry: a lens and a quill that are wider, longer or thinner until
// they just touch; between steps the lens travels half a millimeter at most.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <vector>

#include "config/cell_file.h"
#include "planner/cell_model/program_file.h"
#include "planner/cell_model/program_time.h"
#include "planner/check/check_cell.h"
#include "planner/poses/posed_dots.h"
#include "sampling/images/image_file.h"
#include "sampling/model/mesh_repair.h"
#include "sampling/model/model_file.h"
#include "sampling/model/placement.h"
#include "tests/support/leg_motion.h"

namespace {

using namespace hilbrush;
using testing_support::LegLaw;

constexpr double kStepM = .5e-3;
/// Gaps that are tried, widest first, mm; a negative one is a thinner lens, which touches what is that deep
/// in it.
constexpr double kGapsMm[] = {.3, 0, -1, -2, -4, -8};

/// The cell with a lens and a quill that keep this gap to the true ones.
CellDescription with_gap(CellDescription cell, double gap_m) {
  cell.lens.radius_m += gap_m;
  cell.lens.near_m -= gap_m;
  cell.lens.far_m += gap_m;
  cell.arm.quill_radius_m += gap_m;
  return cell;
}

class Gaps {
 public:
  Gaps(const TexturedMesh& mesh, const CellDescription& cell) {
    for (const double gap_mm : kGapsMm)
      cells_.push_back(std::make_unique<CheckCell>(mesh, with_gap(cell, gap_mm * 1e-3)));
  }
  /// How many of the gaps, from `from` on, are not kept.
  std::size_t touched(const Joints& joints, std::size_t from) const {
    std::size_t count = from;
    while (count < cells_.size() && !cells_[count]->body_fault(joints).empty()) ++count;
    return count;
  }
  double travel_m(const Joints& a, const Joints& b) const {
    return cells_[1]->travel_m(cells_[1]->X_OF(a), cells_[1]->X_OF(b));
  }

 private:
  std::vector<std::unique_ptr<CheckCell>> cells_;
};

struct Leg {
  Joints from, to;
  std::size_t exposure;
};

std::vector<Leg> legs_of(const CellDescription& cell, const ExposureProgram& program) {
  std::vector<Leg> legs;
  Joints at = home_joints(cell);
  for (std::size_t i = 0; i <= program.exposures.size(); ++i) {
    const auto go = [&](const Joints& to) {
      if (to != at) legs.push_back({at, to, i});
      at = to;
    };
    for (const Via& via : program.vias_before(i)) go(via.joints);
    if (i < program.exposures.size()) go(program.exposures[i].joints);
  }
  return legs;
}

/// A leg of a few mm between two dots of one pose of the table, whose ends keep 1 mm.
bool is_short(const Gaps& gaps, const Leg& leg) {
  constexpr double kTravelM = 3e-3;
  constexpr double kTurn = .1;  // rad, of any joint
  for (const std::size_t axis : {kJ1, kJ2, kJ4})
    if (std::abs(leg.to[axis] - leg.from[axis]) > kTurn) return false;
  return leg.to[kTilt] == leg.from[kTilt] && leg.to[kRotation] == leg.from[kRotation] &&
         gaps.travel_m(leg.from, leg.to) < kTravelM;
}

/// How many gaps are not kept on this leg.
std::size_t touched_on(const CellDescription& cell, const Gaps& gaps, const Leg& leg, const LegLaw& law) {
  const double end_s = testing_support::leg_end_s(cell, law, leg.from, leg.to);
  std::size_t touched = 0;
  Joints before = leg.from;
  double step_s = end_s / 8;
  for (double now_s = 0; now_s < end_s;) {
    Joints now = testing_support::joints_on_leg(cell, law, leg.from, leg.to, now_s + step_s);
    while (step_s > 1e-5 && gaps.travel_m(before, now) > kStepM) {
      step_s /= 2;
      now = testing_support::joints_on_leg(cell, law, leg.from, leg.to, now_s + step_s);
    }
    now_s += step_s;
    step_s = std::min(2 * step_s, std::max(end_s - now_s, 1e-6));
    touched = gaps.touched(now, touched);
    before = now;
  }
  return touched;
}

void report(const CellDescription& cell, const Gaps& gaps, const std::vector<Leg>& legs, const LegLaw& law) {
  std::vector<std::size_t> not_kept(std::size(kGapsMm) + 1, 0);
  for (const Leg& leg : legs)
    for (std::size_t gap = touched_on(cell, gaps, leg, law); gap > 0; --gap) ++not_kept[gap - 1];
  std::printf("| robot %s, table %s, robot %+.0f ms late, table %+.0f |",
              law.is_robot_coordinated ? "coordinated" : "independent",
              law.is_table_coordinated ? "coordinated" : "independent", law.robot_late_s * 1e3,
              law.table_late_s * 1e3);
  for (std::size_t gap = 0; gap < std::size(kGapsMm); ++gap) std::printf(" %zu |", not_kept[gap]);
  std::printf("\n");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4 || argc > 5) {
    std::fprintf(stderr, "usage: motion_bench PROGRAM.ply MODEL SIZE_MM [LATE_MS]\n");
    return 2;
  }
  const double late_s = (argc > 4 ? std::atof(argv[4]) : 20) * 1e-3;
  const CellDescription cell = load_cell(find_cell("default"));
  PlacementOptions placement;
  placement.size_m = std::atof(argv[3]) * 1e-3;
  const TexturedMesh mesh = repair_mesh(place_on_table(load_model(argv[2], load_image_file), placement)).mesh;
  const ExposureProgram program = read_program(argv[1]);
  const Gaps gaps(mesh, cell);

  std::vector<Leg> legs = legs_of(cell, program);
  const std::size_t all = legs.size();
  std::erase_if(legs, [&](const Leg& leg) { return is_short(gaps, leg); });
  std::printf("%zu exposures, %zu way-points, %.1f s; %zu of %zu legs looked at\n", program.exposures.size(),
              program.vias.size(), estimate_time(cell, program).total_s(), legs.size(), all);
  std::printf(
      "| law | legs nearer than .3 mm | touching | 1 mm deep | 2 | 4 | 8 |\n|---|---|---|---|---|---|---|\n");
  for (const bool robot : {false, true})
    for (const bool table : {false, true})
      for (const double late : {0., -late_s, -late_s / 2, late_s / 2, late_s})
        report(cell, gaps, legs, {robot, table, std::max(0., -late), std::max(0., late)});
  return 0;
}
