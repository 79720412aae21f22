#include "planner/poses/yaw_redundancy.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "planner/poses/step_cost.h"
#include "sampling/base/angles.h"
#include "tests/planner/workpieces.h"

namespace hilbrush {
namespace {

constexpr double kNominal = 5 * kDegree;

/// Rows back and forth on the top of a block, level when the table is tilted to meet the beam.
struct Rows {
  CellDescription cell = default_cell();
  TexturedMesh mesh = drilled_block();
  DotSequence dots;
  PlanOptions options{.planning = Planning::kFast};
  Station station;
  std::vector<std::uint32_t> dot_indices, tour;

  explicit Rows(double pitch_m) {
    dots.pitch_m = pitch_m;
    constexpr int kAcross = 30, kAlong = 12;
    for (int row = 0; row < kAlong; ++row)
      for (int i = 0; i < kAcross; ++i) {
        const double x = ((row % 2 ? kAcross - 1 - i : i) - .5 * (kAcross - 1)) * pitch_m;
        Dot dot;
        dot.position_O = {x, .008 + row * pitch_m, .04};
        dot.normal_O = dot.smooth_normal_O = {0, 0, 1};
        dots.dots.push_back(dot);
      }
    dot_indices.resize(dots.dots.size());
    std::iota(dot_indices.begin(), dot_indices.end(), 0U);
    tour = dot_indices;
  }

  /// Five degrees off the normal of the block's top, the table tilted to meet the beam.
  std::vector<Joints> nominal(const Reach& reach) {
    const double tilt = std::numbers::pi / 2 - cell.arm.beam_depression;
    const Eigen::Vector3d beam_O(std::sin(kNominal), 0, -std::cos(kNominal));
    const TableSolutions solutions = solve_table(reach.kinematics(), tilt, beam_O);
    EXPECT_FALSE(solutions.empty());
    station = {tilt, solutions[0].rotation, solutions[0].yaw, Elbow::kPositive};
    std::vector<Joints> joints;
    for (const Dot& dot : dots.dots) {
      const auto found = joints_at(reach, station, dot.position_O, joints.empty() ? Joints{} : joints.back());
      EXPECT_TRUE(found);
      joints.push_back(found.value_or(Joints{}));
    }
    return joints;
  }
};

double path_s(const CellDescription& cell, const std::vector<Joints>& path) {
  const StepCost cost(cell);
  double sum = 0;
  for (std::size_t i = 1; i < path.size(); ++i)
    sum += static_cast<double>(cost(arm_of(path[i - 1]), arm_of(path[i])));
  return sum;
}

TEST(YawRedundancy, TurnsTheToolAlongRowsThatTheArmAloneIsSlowAt) {
  Rows rows(2.2e-4);
  const Reach reach(rows.mesh, rows.cell, rows.options);
  const DotsToPose dots(reach, rows.dots, rows.dot_indices);
  const std::vector<Joints> before = rows.nominal(reach);
  std::vector<Joints> after = before;
  use_yaw_redundancy(dots, pose_costs(rows.options), rows.station, rows.tour, after);
  EXPECT_LT(path_s(rows.cell, after), .85 * path_s(rows.cell, before));

  double widest = 0;
  for (std::size_t i = 0; i < after.size(); ++i) {
    const ToolPose tool = reach.kinematics().tool_pose(after[i]);
    EXPECT_LT((tool.focus_O - rows.dots.dots[i].position_O).norm(), 1e-9);
    EXPECT_GE(-tool.beam_O.z(), std::cos(kept_incidence(rows.options)) - 1e-9);
    EXPECT_TRUE(reach.kinematics().limit_excess(after[i]).is_inside());
    EXPECT_EQ(after[i][kTilt], before[i][kTilt]);
    EXPECT_EQ(after[i][kRotation], before[i][kRotation]);
    widest = std::max(widest, std::abs(reach.kinematics().yaw(after[i]) - reach.kinematics().yaw(before[i])));
  }
  EXPECT_GT(widest, .3 * kDegree);
  EXPECT_LT(widest, 8 * kDegree);
}

TEST(YawRedundancy, StaysNearTheNormalWhereThatIsWorthMore) {
  Rows rows(2.2e-4);
  const Reach reach(rows.mesh, rows.cell, rows.options);
  const DotsToPose dots(reach, rows.dots, rows.dot_indices);
  PoseCosts costs = pose_costs(rows.options);
  costs.incidence_s = 100;
  const std::vector<Joints> before = rows.nominal(reach);
  std::vector<Joints> after = before;
  use_yaw_redundancy(dots, costs, rows.station, rows.tour, after);
  for (std::size_t i = 0; i < after.size(); ++i)
    EXPECT_GE(-reach.kinematics().tool_pose(after[i]).beam_O.z(), std::cos(kNominal) - 1e-6) << i;
}

TEST(YawRedundancy, LongToursAreWalkedInBlocksWithoutASeam) {
  Rows rows(1e-4);
  const std::vector<std::uint32_t> once = rows.tour;
  while (rows.tour.size() < 20'000) rows.tour.insert(rows.tour.end(), once.begin(), once.end());
  const Reach reach(rows.mesh, rows.cell, rows.options);
  const DotsToPose dots(reach, rows.dots, rows.dot_indices);
  const std::vector<Joints> one = rows.nominal(reach);
  std::vector<Joints> before;
  while (before.size() < rows.tour.size()) before.insert(before.end(), one.begin(), one.end());
  std::vector<Joints> after = before;
  use_yaw_redundancy(dots, pose_costs(rows.options), rows.station, rows.tour, after);
  EXPECT_LE(path_s(rows.cell, after), path_s(rows.cell, before));
  for (std::size_t i = 1; i < after.size(); ++i)
    if (i % once.size() != 0) {
      EXPECT_LT(std::abs(reach.kinematics().yaw(after[i]) - reach.kinematics().yaw(after[i - 1])),
                1 * kDegree)
          << i;
    }
}

}  // namespace
}  // namespace hilbrush
