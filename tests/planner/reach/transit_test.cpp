#include "planner/reach/transit.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "planner/cell_model/time_model.h"
#include "planner/check/check_cell.h"
#include "planner/poses/posed_dots.h"
#include "tests/planner/workpieces.h"

namespace hilbrush {
namespace {

/// Looks at every hundredth of every leg.
void expect_clear(const CheckCell& check, const CellDescription& cell, const std::vector<Joints>& path,
                  const std::string& what) {
  for (std::size_t leg = 1; leg < path.size(); ++leg)
    for (double t = 0; t <= 1; t += .01) {
      const Joints at = joints_during(cell, path[leg - 1], path[leg], t * move_s(cell, path[leg - 1], path[leg]));
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

TEST(Transit, WaysBetweenRandomPosesAreClear) {
  constexpr unsigned kSeed = 51;
  for (const CellDescription& cell : {default_cell(), low_cell()}) {
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
