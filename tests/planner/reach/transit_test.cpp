#include "planner/reach/transit.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "planner/check/check_cell.h"
#include "planner/poses/posed_dots.h"
#include "tests/planner/workpieces.h"
#include "tests/support/leg_motion.h"

namespace hilbrush {
namespace {

using testing_support::joints_on_leg;
using testing_support::leg_end_s;
using testing_support::LegLaw;

/// Every law that the cell's controllers may follow, with either chain late.
std::vector<LegLaw> laws_of(const CellDescription& cell) {
  std::vector<LegLaw> laws;
  const auto may = [](Interpolation stated, bool is_coordinated) {
    return stated == Interpolation::kUnknown || (stated == Interpolation::kCoordinated) == is_coordinated;
  };
  for (const bool robot : {false, true})
    for (const bool table : {false, true})
      for (const double late : {-1., -.5, 0., .5, 1.})
        if (may(cell.motion.robot, robot) && may(cell.motion.table, table))
          laws.push_back({robot, table, std::max(0., -late) * cell.motion.start_lag_s,
                          std::max(0., late) * cell.motion.start_lag_s});
  return laws;
}

/// Looks at every hundredth of every leg, under every law.
void expect_clear(const CheckCell& check, const CellDescription& cell, const std::vector<Joints>& path,
                  const std::string& what) {
  for (std::size_t leg = 1; leg < path.size(); ++leg)
    for (const LegLaw& law : laws_of(cell))
      for (double t = 0; t <= 1; t += .01) {
        const double time_s = t * leg_end_s(cell, law, path[leg - 1], path[leg]);
        const Joints at = joints_on_leg(cell, law, path[leg - 1], path[leg], time_s);
        ASSERT_EQ(check.body_fault(at), "") << what << ", leg " << leg;
      }
}

/// A cell whose forearm is so low that it has to go round the object.
CellDescription low_cell() {
  CellDescription cell = default_cell();
  cell.arm.fore_link = {.height_m = .27, .radius_m = .02};
  cell.arm.upper_link = {.height_m = .3, .radius_m = .02};
  cell.arm.quill_length_m = .3;
  cell.axes[kJ3].max = .2;
  cell.axes[kJ3].home = .19;
  return cell;
}

/// A cell that says how its controllers lead their joints, which start together.
CellDescription coordinated_cell() {
  CellDescription cell = default_cell();
  cell.motion = {Interpolation::kCoordinated, Interpolation::kIndependent, 0};
  return cell;
}

TEST(Transit, WaysBetweenRandomPosesAreClear) {
  constexpr unsigned kSeed = 51;
  for (const CellDescription& cell : {default_cell(), low_cell(), coordinated_cell()}) {
    const TexturedMesh mesh = ball(.03);
    const Reach reach(mesh, cell, {});
    const Transit transit(reach);
    const CheckCell check(mesh, cell);
    const DotSequence dots = scatter(mesh, 3e-3, kSeed);
    std::mt19937 random(kSeed);
    Joints now = home_joints(cell);
    std::size_t found = 0;
    std::size_t tried = 0;
    for (int n = 0; n < 40; ++n) {
      const auto pose = reach.find_pose(target_of(dots.dots[random() % dots.dots.size()]), now).pose;
      if (!pose) continue;
      ++tried;
      const auto path = transit.route_by_search(now, pose->joints);
      if (!path) continue;
      ++found;
      std::vector<Joints> whole{now};
      whole.insert(whole.end(), path->begin(), path->end());
      whole.push_back(pose->joints);
      expect_clear(check, cell, whole, "path " + std::to_string(n) + ", seed " + std::to_string(kSeed));
      now = pose->joints;
    }
    EXPECT_GE(found, tried * 9 / 10);
    EXPECT_GT(tried, 10U);
  }
}

TEST(Transit, TheSearchFindsWhatSimpleWaysMiss) {
  const CellDescription cell = low_cell();
  const TexturedMesh mesh = ball(.03);
  const Reach reach(mesh, cell, {});
  const Transit transit(reach);
  const DotSequence dots = scatter(mesh, 3e-3);
  std::size_t simple = 0;
  std::size_t searched = 0;
  for (std::size_t i = 0; i < dots.dots.size(); i += 29) {
    const auto pose = reach.find_pose(target_of(dots.dots[i]), home_joints(cell)).pose;
    if (!pose) continue;
    simple += transit.route(home_joints(cell), pose->joints).has_value();
    searched += transit.route_by_search(home_joints(cell), pose->joints).has_value();
  }
  EXPECT_GE(searched, simple);
  EXPECT_GT(searched, 5U);
}

/// What one controller may do and another may not: moves that are clear in an unknown cell are clear in every
/// cell, and some are clear only in a cell that is known.
TEST(Transit, AnUnknownInterpolationIsClearUnderAll) {
  const TexturedMesh mesh = ball(.03);
  CellDescription cell = default_cell();
  constexpr unsigned kSeed = 61;
  const DotSequence dots = scatter(mesh, 3e-3, kSeed);
  std::mt19937 random(kSeed);
  const Reach unknown(mesh, cell, {});
  std::vector<std::pair<Joints, Joints>> moves;
  for (int n = 0; n < 300; ++n) {
    const auto from =
        unknown.find_pose(target_of(dots.dots[random() % dots.dots.size()]), home_joints(cell)).pose;
    const auto to =
        unknown.find_pose(target_of(dots.dots[random() % dots.dots.size()]), home_joints(cell)).pose;
    if (from && to) moves.emplace_back(from->joints, to->joints);
  }
  std::size_t clear_unknown = 0;
  std::size_t only_known = 0;
  for (const double lag_s : {0., .02}) {
    cell.motion = {Interpolation::kUnknown, Interpolation::kUnknown, .02};
    const Reach any(mesh, cell, {});
    for (const Interpolation robot : {Interpolation::kIndependent, Interpolation::kCoordinated})
      for (const Interpolation table : {Interpolation::kIndependent, Interpolation::kCoordinated}) {
        cell.motion = {robot, table, lag_s};
        const Reach known(mesh, cell, {});
        for (const auto& [from, to] : moves) {
          const bool is_clear = Transit(any).is_clear(from, to);
          clear_unknown += is_clear;
          if (is_clear)
            EXPECT_TRUE(Transit(known).is_clear(from, to)) << "seed " << kSeed;
          else
            only_known += Transit(known).is_clear(from, to);
        }
      }
  }
  EXPECT_GT(clear_unknown, 0U);
  EXPECT_GT(only_known, 0U);
}

TEST(Transit, SameWayEachTime) {
  const CellDescription cell = low_cell();
  const TexturedMesh mesh = ball(.03);
  const Reach reach(mesh, cell, {});
  const auto pose = reach.find_pose({{.03, 0, .03}, {1, 0, 0}, {1, 0, 0}}, home_joints(cell)).pose;
  ASSERT_TRUE(pose);
  EXPECT_EQ(Transit(reach).route_by_search(home_joints(cell), pose->joints),
            Transit(reach).route_by_search(home_joints(cell), pose->joints));
}

TEST(Transit, NoWayLeadsIntoTheObject) {
  const CellDescription cell = default_cell();
  const TexturedMesh mesh = ball(.03);
  const Reach reach(mesh, cell, {});
  const Transit transit(reach);
  Joints inside = home_joints(cell);
  const TablePose table = reach.kinematics().table_pose(0, 0);
  ASSERT_TRUE(reach.kinematics().solve_arm(table.to_W({.07, 0, -.04}), 0, Elbow::kPositive, inside));
  EXPECT_FALSE(transit.is_clear_at(inside));
  EXPECT_FALSE(transit.route_by_search(home_joints(cell), inside));
  EXPECT_FALSE(transit.is_clear(home_joints(cell), inside));
}

}  // namespace
}  // namespace hilbrush
