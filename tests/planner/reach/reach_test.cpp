#include "planner/reach/reach.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "sampling/base/angles.h"
#include "tests/planner/reach/pose_grid.h"
#include "tests/planner/workpieces.h"

namespace hilbrush {
namespace {

using Eigen::Vector3d;

/// Expects that the point is out of reach, and returns why.
SkippedDot refused(const Reach& reach, const Vector3d& position_O, const Vector3d& normal_O) {
  const PoseSearchResult found = reach.find_pose({position_O, normal_O, normal_O}, {});
  EXPECT_FALSE(found.pose.has_value());
  return found.skipped;
}

TEST(Reach, ABallIsReachedAllOverButUnderItsPost) {
  const CellDescription cell = default_cell();
  const Reach reach(ball(.02), cell, {});
  const DotSequence dots = scatter(ball(.02), 1e-3);
  for (const Dot& dot : dots.dots) {
    const double from_axis_m = dot.position_O.head<2>().norm();
    const bool is_under_post = dot.position_O.z() < .005 && from_axis_m < .008;
    if (is_under_post) continue;
    const Vector3d normal_O = dot.normal_O.cast<double>();
    const PoseSearchResult found = reach.find_pose({dot.position_O, normal_O, normal_O}, {});
    EXPECT_TRUE(found.pose.has_value()) << dot.position_O.transpose() << ": " << found.skipped.detail;
  }
}

TEST(Reach, ADotUnderThePostIsBlockedByTheTable) {
  const Reach reach(small_cup(), default_cell(), {});
  const SkippedDot skipped = refused(reach, {0, 0, 0}, {0, 0, -1});
  EXPECT_EQ(skipped.reason, SkipReason::kLensTable);
  EXPECT_NE(skipped.detail.find("table"), std::string::npos) << skipped.detail;
  // Farther out on the same underside the beam passes post and plate obliquely.
  EXPECT_TRUE(reach.is_reachable({.012, 0, 0}, {0, 0, -1}));
}

TEST(Reach, AHoleIsSeenAsDeepAsTheConeAllows) {
  const CellDescription cell = default_cell();
  const Reach reach(drilled_block(), cell, {});
  // At 45 degrees the beam clears the opposite rim, 8 mm across, from less than 8 mm below it. Facets take a
  // little of that.
  const double top_m = .04;
  const double radius_m = .004 * std::cos(std::numbers::pi / 96);
  for (const double depth_m : {.001, .004, .007})
    EXPECT_TRUE(reach.is_reachable({-radius_m, 0, top_m - depth_m}, {1, 0, 0})) << depth_m;
  for (const double depth_m : {.009, .012, .025}) {
    const SkippedDot skipped = refused(reach, {-radius_m, 0, top_m - depth_m}, {1, 0, 0});
    EXPECT_EQ(skipped.reason, SkipReason::kOccluded) << skipped.detail;
    EXPECT_NE(skipped.detail.find("mm from the dot"), std::string::npos) << skipped.detail;
  }
  // The bottom is seen straight down the hole, from its middle at least.
  EXPECT_TRUE(reach.is_reachable({0, 0, .01}, {0, 0, 1}));
}

TEST(Reach, WhatIsInsideIsOccluded) {
  const Reach reach(ball(.02), default_cell(), {});
  const SkippedDot skipped = refused(reach, {.001, .002, .02}, {0, 0, 1});
  EXPECT_EQ(skipped.reason, SkipReason::kOccluded);
}

TEST(Reach, JointLimitsAreNamedWithTheAmount) {
  CellDescription cell = default_cell();
  cell.axes[kJ2].min = -.2;
  cell.axes[kJ2].max = .2;  // hardly any elbow: the arm only reaches far out
  const Reach reach(ball(.02), cell, {});
  SkippedDot skipped = refused(reach, {0, 0, .04}, {0, 0, 1});
  EXPECT_EQ(skipped.reason, SkipReason::kJointLimit);
  EXPECT_NE(skipped.detail.find("past its limit"), std::string::npos) << skipped.detail;

  cell = default_cell();
  cell.arm.upper_arm_m = .05;
  cell.arm.forearm_m = .05;
  const Reach short_reach(ball(.02), cell, {});
  skipped = refused(short_reach, {0, 0, .04}, {0, 0, 1});
  EXPECT_EQ(skipped.reason, SkipReason::kJointLimit);
  EXPECT_NE(skipped.detail.find("out of the arm's reach"), std::string::npos) << skipped.detail;
}

TEST(Reach, WithoutTiltTheSidesCannotBeTurnedToTheBeam) {
  CellDescription cell = default_cell();
  cell.arm.beam_depression = 80 * kDegree;
  cell.axes[kTilt].min = -.05;
  cell.axes[kTilt].max = .05;
  const Reach reach(ball(.02), cell, {});
  const SkippedDot skipped = refused(reach, {.02, 0, .02}, {1, 0, 0});
  EXPECT_EQ(skipped.reason, SkipReason::kIncidence) << skipped.detail;
}

TEST(Reach, AThickLensTouchesTheObject) {
  CellDescription cell = default_cell();
  cell.lens.near_m = .004;  // hardly any working distance: the lens has to go into the hole
  const Reach reach(drilled_block(), cell, {});
  const SkippedDot skipped = refused(reach, {0, 0, .01}, {0, 0, 1});
  EXPECT_EQ(skipped.reason, SkipReason::kLensObject) << skipped.detail;
  EXPECT_NE(skipped.detail.find("lens body"), std::string::npos) << skipped.detail;
}

TEST(Reach, ALowForearmTouchesTheObject) {
  CellDescription cell = default_cell();
  cell.arm.fore_link.height_m = .2;  // in the middle of the object
  const Reach reach(small_cup(), cell, {});
  const SkippedDot skipped = refused(reach, {.0, 0, .025}, {0, 0, 1});
  EXPECT_EQ(skipped.reason, SkipReason::kArm) << skipped.detail;
  EXPECT_NE(skipped.detail.find("an arm link would touch the"), std::string::npos) << skipped.detail;
  EXPECT_GT(skipped.amount, 0);
}

TEST(Reach, AWideColumnIsNamed) {
  CellDescription cell = default_cell();
  cell.arm.column = {.height_m = .36, .radius_m = .34};  // the arm cannot work above the table
  cell.table.tilt_axis_W.x() = .3;
  const Reach reach(ball(.02), cell, {});
  const SkippedDot skipped = refused(reach, {0, 0, .04}, {0, 0, 1});
  EXPECT_EQ(skipped.reason, SkipReason::kArm) << skipped.detail;
  EXPECT_NE(skipped.detail.find("the robot's column"), std::string::npos) << skipped.detail;
  EXPECT_GT(skipped.amount, 0);
}

/// The egg-cup shapes, whatever is out of reach, and every reason there is.
TEST(Reach, WhatIsSkippedIsOutOfReachOfAFineGridOfPoses) {
  struct Case {
    const char* name;
    TexturedMesh mesh;
    std::function<void(CellDescription&)> change;
  };
  const Case cases[] = {
      {"cup on no post", small_cup(), [](CellDescription& c) { c.fixture.post_height_m = 0; }},
      {"drilled block", drilled_block(), [](CellDescription&) {}},
      {"short tilt", ball(.02), [](CellDescription& c) { c.axes[kTilt].max = .5; }},
      {"narrow elbow", ball(.02), [](CellDescription& c) { c.axes[kJ2].min = 1.9, c.axes[kJ2].max = 2.2; }},
      {"low forearm", ball(.02), [](CellDescription& c) { c.arm.fore_link.height_m = .24; }},
      {"wide column", ball(.02), [](CellDescription& c) { c.arm.column.radius_m = .16; }},
      {"thick lens", drilled_block(), [](CellDescription& c) { c.lens.near_m = .02; }}};
  constexpr std::size_t kLooks = 12;
  for (const Case& one : cases) {
    CellDescription cell = default_cell();
    one.change(cell);
    const Reach reach(one.mesh, cell, {});
    std::vector<Target> skipped;
    for (const Dot& dot : scatter(one.mesh, 2e-3).dots) {
      const Vector3d normal = dot.normal_O.cast<double>().normalized();
      if (!reach.is_reachable(dot.position_O, normal)) skipped.push_back({dot.position_O, normal, normal});
    }
    EXPECT_FALSE(skipped.empty()) << one.name;
    const std::size_t stride = std::max<std::size_t>(1, skipped.size() / kLooks);
    for (std::size_t i = 0; i < skipped.size(); i += stride)
      EXPECT_FALSE(search_pose_grid(reach, skipped[i], 4 * kDegree).is_reached)
          << one.name << ": " << skipped[i].position_O.transpose();
  }
}

TEST(Reach, FoundPosesAreWithinTheConeAndTheLimits) {
  const CellDescription cell = default_cell();
  const TexturedMesh mesh = small_cup();
  PlanOptions options;
  options.max_incidence = 30 * kDegree;
  const Reach reach(mesh, cell, options);
  std::size_t found = 0;
  for (const Dot& dot : scatter(mesh, 1e-3).dots) {
    const Target target{dot.position_O, dot.normal_O.cast<double>(), dot.smooth_normal_O.cast<double>()};
    const auto pose = reach.find_pose(target, home_joints(cell)).pose;
    if (!pose) continue;
    ++found;
    const ToolPose tool = reach.kinematics().tool_pose(pose->joints);
    EXPECT_LT((tool.focus_O - dot.position_O).norm(), 1e-9);
    EXPECT_GE(-tool.beam_O.dot(target.face_normal_O), std::cos(options.max_incidence));
    EXPECT_TRUE(reach.kinematics().limit_excess(pose->joints).is_inside());
    EXPECT_EQ(reach.clearance().body_obstruction(tool), Obstruction::kNone);
  }
  EXPECT_GT(found, 1000U);
}

TEST(ObjectDistance, IsTheDistanceToABall) {
  const double radius_m = .02;
  const double range_m = .04;
  const ObjectDistance distance(ball(radius_m), range_m);
  const Vector3d center(0, 0, radius_m);
  std::mt19937 random(21);
  std::uniform_real_distribution<double> uniform(-.08, .08);
  for (int n = 0; n < 20'000; ++n) {
    const Vector3d p = center + Vector3d(uniform(random), uniform(random), uniform(random));
    const double expected_m = (p - center).norm() - radius_m;
    if (expected_m < .005) continue;
    const double facets_m = radius_m * (1 - std::cos(std::numbers::pi / 24));  // the ball is a polyhedron
    EXPECT_LE(distance(p), std::min(range_m, expected_m + facets_m) + distance.error_m(expected_m))
        << p.transpose();
    EXPECT_GE(distance(p), std::min(range_m, expected_m) - 5e-4) << p.transpose();
  }
}

}  // namespace
}  // namespace hilbrush
