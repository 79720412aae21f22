#include "planner/reach/clearance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "planner/check/check_cell.h"
#include "tests/planner/reach/ray_bundle.h"
#include "tests/planner/workpieces.h"

namespace hilbrush {
namespace {

using Eigen::Vector3d;

Vector3d random_direction(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Vector3d(normal(random), normal(random), normal(random)).normalized();
}

TEST(Clearance, SlackIsALowerBoundOnTheWayToTouching) {
  const CellDescription cell = default_cell();
  const Clearance clearance(ball(.02), cell);
  // The beam straight down on the ball's top; the lens is lowered until it touches.
  const Vector3d beam_O(0, 0, -1), up_O = Vector3d(1, 0, 1).normalized();
  EXPECT_GT(clearance.slack_m({{0, 0, .04}, beam_O, up_O}), .02);
  for (double z = .04; z > -.03; z -= .001) {
    const double gap_m =
        z + cell.lens.near_m - .04;  // the lens's end is 60 mm above the focus, the ball's top at 40 mm
    const double slack_m = clearance.slack_m({{0, 0, z}, beam_O, up_O});
    EXPECT_LE(slack_m, std::max(0., gap_m) + 1e-4) << z;
    if (gap_m > .005) {
      EXPECT_GE(slack_m, std::min(.02, gap_m - .0125)) << z;
    }
  }
}

/// The distance field against rays: what it calls clear must be clear.
TEST(Clearance, FieldAgreesWithABundleOfRays) {
  constexpr unsigned kSeed = 41;
  const CellDescription cell = default_cell();
  std::size_t looks = 0;
  std::size_t misses = 0;
  std::size_t touching = 0;
  std::size_t cautious = 0;
  for (const TexturedMesh& mesh : {small_cup(), drilled_block(), ball(.03)}) {
    const Clearance clearance(mesh, cell);
    const RayBundle reference(mesh, cell);
    const DotSequence dots = scatter(mesh, 2e-3, kSeed);
    std::mt19937 random(kSeed);
    for (int n = 0; n < 3000; ++n, ++looks) {
      const Dot& dot = dots.dots[random() % dots.dots.size()];
      Vector3d beam_O = random_direction(random);
      if (beam_O.dot(dot.normal_O.cast<double>()) > 0) beam_O = -beam_O;
      const Vector3d up_O = random_direction(random);
      const ToolPose tool{dot.position_O, beam_O, up_O};
      const bool is_clear = clearance.body_obstruction(tool) == Obstruction::kNone;
      const bool touches = reference.lens_touches(tool.focus_O, beam_O) || reference.quill_touches(tool);
      touching += touches;
      misses += is_clear && touches;
      cautious += !is_clear && !touches &&
                  !reference.lens_touches(tool.focus_O, beam_O, Clearance::kMarginM) &&
                  !reference.quill_touches(tool, Clearance::kMarginM);
    }
  }
  EXPECT_LT(static_cast<double>(misses), 5e-4 * static_cast<double>(looks)) << "seed " << kSeed;
  EXPECT_LT(static_cast<double>(cautious), .05 * static_cast<double>(looks)) << "seed " << kSeed;
  EXPECT_GT(touching, looks / 20);
}

/// A small object on a wide post: what no part of the object is near to is not far from everything.
TEST(Clearance, ThePostCountsHoweverWideItIs) {
  CellDescription cell = default_cell();
  cell.fixture.post_radius_m = .06;
  cell.table.plate_radius_m = .02;
  const Clearance clearance(ball(.005), cell);
  const auto quill_over = [&](double x, double z) {
    const Vector3d beam_O(1, 0, 0);
    return clearance.quill_obstruction(
        {Vector3d(x, 0, z) + cell.arm.flange_to_focus_m * beam_O, beam_O, {0, 0, 1}});
  };
  EXPECT_EQ(quill_over(.058, -.002), Obstruction::kQuillTable);
  EXPECT_EQ(quill_over(.058, .03), Obstruction::kNone);
  EXPECT_EQ(quill_over(.3, -.002), Obstruction::kNone);
}

/// Anywhere within the axes' limits.
Joints any_joints(const CellDescription& cell, std::mt19937& random) {
  Joints joints;
  for (std::size_t axis = 0; axis < kAxisCount; ++axis)
    joints[axis] = std::uniform_real_distribution<double>(cell.axes[axis].min, cell.axes[axis].max)(random);
  return joints;
}

/// Both codes see the same links: where planning keeps its margin, the check finds nothing, and where the
/// check finds a link touching, planning does.
TEST(Clearance, LinksAgreeWithTheIndependentCheck) {
  constexpr unsigned kSeed = 42;
  CellDescription cell = default_cell();
  cell.arm.fore_link = {.height_m = .25, .radius_m = .03};
  cell.arm.upper_link = {.height_m = .27, .radius_m = .02};
  const TexturedMesh mesh = ball(.05);
  const Clearance clearance(mesh, cell);
  const Kinematics kinematics(cell);
  const CheckCell check(mesh, cell);
  std::mt19937 random(kSeed);
  std::size_t touching = 0;
  std::size_t clear = 0;
  for (int n = 0; n < 20'000; ++n) {
    Joints joints = any_joints(cell, random);
    joints[kJ3] = std::min(joints[kJ3], .2);
    const TablePose table = kinematics.table_pose(joints[kTilt], joints[kRotation]);
    const bool is_clear = clearance.links_obstruction(table, joints) == Obstruction::kNone;
    const std::string fault = check.body_fault(joints);
    const bool is_link = fault.find("arm touches") != std::string::npos;
    if (is_link) {
      EXPECT_FALSE(is_clear) << fault << ", seed " << kSeed << ", look " << n;
    }
    touching += is_link;
    clear += is_clear;
    if (clearance.slack_m(kinematics, joints) > 0) {
      EXPECT_EQ(fault, "") << "seed " << kSeed << ", look " << n;
    }
  }
  EXPECT_GT(touching, 300U);
  EXPECT_GT(clear, 3000U);
}

/// The same of the column: against lens, quill and forearm, and against what stands on the table.
TEST(Clearance, TheColumnAgreesWithTheIndependentCheck) {
  constexpr unsigned kSeed = 43;
  CellDescription cell = default_cell();
  cell.arm.column = {.height_m = .3, .radius_m = .11};
  cell.arm.fore_link = {.height_m = .31, .radius_m = .03};
  const TexturedMesh mesh = ball(.07);
  const Clearance clearance(mesh, cell);
  const Kinematics kinematics(cell);
  const CheckCell check(mesh, cell);
  std::mt19937 random(kSeed);
  std::size_t tool = 0;
  std::size_t table = 0;
  std::size_t clear = 0;
  for (int n = 0; n < 20'000; ++n) {
    Joints joints = any_joints(cell, random);
    joints[kTilt] = std::max(joints[kTilt], .8);  // the ball leans towards the robot
    const TablePose pose = kinematics.table_pose(joints[kTilt], joints[kRotation]);
    const bool is_clear = clearance.links_obstruction(pose, joints) == Obstruction::kNone;
    const std::string fault = check.body_fault(joints);
    if (fault.find("column") != std::string::npos) {
      EXPECT_FALSE(is_clear) << fault << ", seed " << kSeed << ", look " << n;
      EXPECT_LE(clearance.slack_m(kinematics, joints), 0) << fault << ", seed " << kSeed << ", look " << n;
      ++(fault.starts_with("the robot's column") ? table : tool);
    }
    clear += is_clear;
    if (clearance.slack_m(kinematics, joints) > 0) {
      EXPECT_EQ(fault, "") << "seed " << kSeed << ", look " << n;
    }
  }
  EXPECT_GT(tool, 100U);
  EXPECT_GT(table, 100U);
  EXPECT_GT(clear, 1000U);
}

TEST(Clearance, LinksOfTheShippedCellCannotTouchAnything) {
  const CellDescription cell = default_cell();
  const Clearance clearance(ball(.04), cell);
  const Kinematics kinematics(cell);
  for (double tilt = cell.axes[kTilt].min; tilt < cell.axes[kTilt].max; tilt += .1) {
    Joints joints{.3, -.6, .3, 0, tilt, 0};
    EXPECT_EQ(clearance.links_obstruction(kinematics.table_pose(tilt, 0), joints), Obstruction::kNone);
  }
}

TEST(ArmLinks, TheColumnHasAFlatTop) {
  CellDescription::Arm arm;
  arm.column = {.height_m = .3, .radius_m = .1};
  EXPECT_NEAR(column_gap_m(arm, {{.3, 0, .1}, {.3, 0, .2}, .05}), .15, 1e-12);             // beside it
  EXPECT_NEAR(column_gap_m(arm, {{-.5, 0, .37}, {.5, 0, .37}, .05}), .02, 1e-12);          // across its top
  EXPECT_NEAR(column_gap_m(arm, {{-.5, .12, .2}, {.5, .12, .2}, .05}), .12 - .15, 1e-12);  // through it
}

TEST(ArmLinks, GapOfCapsules) {
  const Capsule a{{0, 0, 0}, {1, 0, 0}, .1};
  EXPECT_NEAR(capsule_gap_m(a, {{0, 1, 1}, {1, 1, 1}, .2}), std::sqrt(2) - .3, 1e-12);    // parallel
  EXPECT_NEAR(capsule_gap_m(a, {{.5, -1, .5}, {.5, 1, .5}, .2}), .2, 1e-12);              // crossing
  EXPECT_NEAR(capsule_gap_m(a, {{2, 0, 0}, {3, 0, 0}, .2}), .7, 1e-12);                   // end to end
  EXPECT_NEAR(capsule_gap_m(a, {{-1, 1, 0}, {-1, 1, 0}, .2}), std::sqrt(2) - .3, 1e-12);  // a ball
  EXPECT_NEAR(capsule_gap_m({{1, 0, 0}, {1, 0, 0}, 0}, {{3, 0, 0}, {3, 0, 0}, 0}), 2, 1e-12);
}

}  // namespace
}  // namespace hilbrush
