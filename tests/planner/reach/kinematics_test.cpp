#include "planner/reach/kinematics.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <string>

#include "planner/check/check_cell.h"
#include "planner/reach/reach.h"
#include "sampling/base/angles.h"
#include "tests/planner/workpieces.h"

namespace hilbrush {
namespace {

constexpr double kPi = kTurn / 2;

Joints random_joints(const CellDescription& cell, std::mt19937& random) {
  std::uniform_real_distribution<double> share(0, 1);
  Joints joints;
  for (std::size_t i = 0; i < kAxisCount; ++i)
    joints[i] = cell.axes[i].min + share(random) * (cell.axes[i].max - cell.axes[i].min);
  return joints;
}

/// A slice of the ten million poses, or all with HILBRUSH_LONG=1.
int pose_count() {
  return std::getenv("HILBRUSH_LONG") ? 10'000'000 : 200'000;
}

TEST(Kinematics, InverseOfForwardIsTheSamePose) {
  const CellDescription cell = default_cell();
  const Kinematics kinematics(cell);
  constexpr unsigned kSeed = 11;
  std::mt19937 random(kSeed);
  double worst_m = 0;
  double worst_rad = 0;
  for (int n = 0; n < pose_count(); ++n) {
    const Joints joints = random_joints(cell, random);
    if (std::abs(std::sin(joints[kJ2])) < 1e-3) continue;  // the straight arm, which planning keeps away from
    const ToolPose tool = kinematics.tool_pose(joints);
    const TablePose table = kinematics.table_pose(joints[kTilt], joints[kRotation]);
    for (const Elbow elbow : {Elbow::kPositive, Elbow::kNegative}) {
      Joints found = joints;
      ASSERT_TRUE(kinematics.solve_arm(table.to_W(tool.focus_O), kinematics.yaw(joints), elbow, found))
          << "pose " << n;
      const ToolPose again = kinematics.tool_pose(found);
      worst_m = std::max(worst_m, (again.focus_O - tool.focus_O).norm());
      worst_rad = std::max(worst_rad, (again.beam_O - tool.beam_O).norm());
      ASSERT_LT(worst_m, 1e-9) << "pose " << n << ", seed " << kSeed;
      ASSERT_LT(worst_rad, 1e-9) << "pose " << n << ", seed " << kSeed;
      ASSERT_EQ(elbow == Elbow::kPositive, found[kJ2] > 0);
      if ((joints[kJ2] > 0) == (elbow == Elbow::kPositive)) {
        ASSERT_NEAR(found[kJ2], joints[kJ2], 1e-9) << "pose " << n;
        ASSERT_NEAR(std::remainder(found[kJ1] - joints[kJ1], kTurn), 0, 1e-9) << "pose " << n;
      }
    }
  }
  RecordProperty("worst_m", std::to_string(worst_m));
  RecordProperty("worst_rad", std::to_string(worst_rad));
}

TEST(Kinematics, RatesOverYawAreThoseOfTheInverse) {
  const CellDescription cell = default_cell();
  const Kinematics kinematics(cell);
  constexpr unsigned kSeed = 13;
  std::mt19937 random(kSeed);
  for (int n = 0; n < 1000; ++n) {
    const Joints joints = random_joints(cell, random);
    if (std::abs(std::sin(joints[kJ2])) < .1) continue;
    const TablePose table = kinematics.table_pose(joints[kTilt], joints[kRotation]);
    const Eigen::Vector3d focus_W = table.to_W(kinematics.tool_pose(joints).focus_O);
    const Elbow elbow = joints[kJ2] > 0 ? Elbow::kPositive : Elbow::kNegative;
    constexpr double kStep = 1e-6;
    Joints before = joints;
    Joints after = joints;
    ASSERT_TRUE(kinematics.solve_arm(focus_W, kinematics.yaw(joints) - kStep, elbow, before));
    ASSERT_TRUE(kinematics.solve_arm(focus_W, kinematics.yaw(joints) + kStep, elbow, after));
    const Joints rates = kinematics.per_yaw(joints);
    for (std::size_t axis = 0; axis < kAxisCount; ++axis)
      EXPECT_NEAR(rates[axis], std::remainder(after[axis] - before[axis], kTurn) / (2 * kStep), 1e-4)
          << kAxisNames[axis] << ", pose " << n << ", seed " << kSeed;
  }
}

TEST(Kinematics, InverseOfTheWholeChainIsTheSameBeamOnTheSameDot) {
  // Only dot, beam and tilt are given: rotation, yaw and the arm are solved for, two ways and with both
  // elbows.
  const CellDescription cell = default_cell();
  const Kinematics kinematics(cell);
  constexpr unsigned kSeed = 17;
  std::mt19937 random(kSeed);
  std::size_t solved = 0;
  for (int n = 0; n < pose_count() / 2; ++n) {
    const Joints joints = random_joints(cell, random);
    if (std::abs(std::sin(joints[kTilt])) < 1e-3) continue;  // A = 0: C turns about the same axis as yaw
    const ToolPose tool = kinematics.tool_pose(joints);
    for (const TableSolution& solution : solve_table(kinematics, joints[kTilt], tool.beam_O))
      for (const Elbow elbow : {Elbow::kPositive, Elbow::kNegative}) {
        const TablePose table = kinematics.table_pose(joints[kTilt], solution.rotation);
        Joints found{};
        found[kTilt] = joints[kTilt];
        found[kRotation] = solution.rotation;
        if (!kinematics.solve_arm(table.to_W(tool.focus_O), solution.yaw, elbow, found)) continue;
        ++solved;
        const ToolPose again = kinematics.tool_pose(found);
        ASSERT_LT((again.focus_O - tool.focus_O).norm(), 1e-9) << "pose " << n << ", seed " << kSeed;
        ASSERT_LT((again.beam_O - tool.beam_O).norm(), 1e-9) << "pose " << n << ", seed " << kSeed;
      }
  }
  EXPECT_GT(solved, static_cast<std::size_t>(pose_count()) / 4);
}

TEST(Kinematics, AgreesWithTheChainOfTransformsThatTheCheckUses) {
  const CellDescription cell = default_cell();
  const Kinematics kinematics(cell);
  const CheckCell check_cell(ball(.02), cell);
  std::mt19937 random(12);
  for (int n = 0; n < 10'000; ++n) {
    const Joints joints = random_joints(cell, random);
    const ToolPose tool = kinematics.tool_pose(joints);
    const Eigen::Isometry3d X_OF = check_cell.X_OF(joints);
    ASSERT_LT((check_cell.focus_O(X_OF) - tool.focus_O).norm(), 1e-12) << "pose " << n;
    ASSERT_LT((check_cell.beam_O(X_OF) - tool.beam_O).norm(), 1e-12) << "pose " << n;
    ASSERT_LT((X_OF.linear().col(2) - tool.up_O).norm(), 1e-12) << "pose " << n;
  }
}

TEST(Kinematics, KnownPoses) {
  CellDescription cell = default_cell();
  cell.arm.beam_depression = kPi / 4;
  const Kinematics kinematics(cell);
  // Arm stretched along x, yaw 0: the focus is ahead of and below the flange.
  Joints joints{};
  joints[kJ3] = .2;
  const ToolPose tool = kinematics.tool_pose(joints);
  const TablePose upright = kinematics.table_pose(0, 0);
  const double leg = cell.arm.flange_to_focus_m / std::sqrt(2.);
  EXPECT_LT((upright.to_W(tool.focus_O) -
             Eigen::Vector3d(cell.arm.upper_arm_m + cell.arm.forearm_m + leg, 0, .2 - leg))
                .norm(),
            1e-12);
  // A tilt of 90 degrees brings the object's top towards the robot.
  const TablePose tilted = kinematics.table_pose(kPi / 2, 0);
  EXPECT_LT((tilted.R_WO * Eigen::Vector3d::UnitZ() + Eigen::Vector3d::UnitX()).norm(), 1e-12);
  // C turns counter-clockwise seen from above.
  const TablePose turned = kinematics.table_pose(0, kPi / 2);
  EXPECT_LT((turned.R_WO * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(), 1e-12);
}

TEST(Kinematics, TableSolutionsPointTheBeam) {
  const CellDescription cell = default_cell();
  const Kinematics kinematics(cell);
  std::mt19937 random(13);
  std::normal_distribution<double> normal;
  std::size_t solved = 0;
  for (int n = 0; n < 20'000; ++n) {
    const Eigen::Vector3d beam_O =
        Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
    const double tilt = .02 + 1.7 * std::abs(std::remainder(normal(random), 1));
    const TableSolutions solutions = solve_table(kinematics, tilt, beam_O);
    solved += solutions.size();
    for (const TableSolution& solution : solutions) {
      const TablePose table = kinematics.table_pose(tilt, solution.rotation);
      const Eigen::Vector3d found = table.R_WO.transpose() * kinematics.beam_W(solution.yaw);
      ASSERT_LT((found - beam_O).norm(), 1e-7) << "direction " << n;
    }
  }
  EXPECT_GT(solved, 5'000U);
}

TEST(Kinematics, LimitsNameTheWorstAxisAndAmount) {
  CellDescription cell = default_cell();
  cell.limit_margin = 0;
  const Kinematics kinematics(cell);
  Joints joints = home_joints(cell);
  EXPECT_TRUE(kinematics.limit_excess(joints).is_inside());
  joints[kJ2] = cell.axes[kJ2].max + .05;
  EXPECT_EQ(kinematics.limit_excess(joints).axis, kJ2);
  EXPECT_NEAR(kinematics.limit_excess(joints).amount, .05, 1e-12);
  joints[kJ3] = cell.axes[kJ3].min - .1;  // a third of its range
  EXPECT_EQ(kinematics.limit_excess(joints).axis, kJ3);
  EXPECT_NEAR(kinematics.limit_excess(joints).amount, .1, 1e-12);
  joints = home_joints(cell);
  joints[kJ2] = 0;  // straight: singular
  EXPECT_FALSE(kinematics.limit_excess(joints).is_inside());
}

TEST(Kinematics, WindingStaysNearAndInsideTheLimits) {
  const CellDescription cell = default_cell();
  const Kinematics kinematics(cell);
  std::mt19937 random(14);
  std::uniform_real_distribution<double> angle(-kPi, kPi), reference(-80, 80);
  for (int n = 0; n < 10'000; ++n) {
    const double a = angle(random);
    const double near = reference(random);
    for (const std::size_t axis : {kJ4, kRotation}) {
      const double unwrapped = kinematics.unwrap_near(axis, a, near);
      ASSERT_NEAR(std::remainder(unwrapped - a, kTurn), 0, 1e-9);
      ASSERT_LE(unwrapped, kinematics.axis_max(axis));
      ASSERT_GE(unwrapped, kinematics.axis_min(axis));
      const double inside =
          std::clamp(near, kinematics.axis_min(axis) + kPi, kinematics.axis_max(axis) - kPi);
      if (inside == near) {
        ASSERT_LE(std::abs(unwrapped - near), kPi + 1e-9);
      }
    }
  }
}

TEST(Kinematics, OutOfTheArmsAnnulus) {
  const CellDescription cell = default_cell();
  const Kinematics kinematics(cell);
  Joints joints{};
  double excess_m = 0;
  EXPECT_FALSE(kinematics.solve_arm({1, 0, .1}, 0, Elbow::kPositive, joints, &excess_m));
  const double flange_m = 1 - cell.arm.flange_to_focus_m * std::cos(cell.arm.beam_depression);
  EXPECT_NEAR(excess_m, flange_m - cell.arm.upper_arm_m - cell.arm.forearm_m, 1e-12);
}

}  // namespace
}  // namespace hilbrush
