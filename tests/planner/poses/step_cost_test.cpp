#include "planner/poses/step_cost.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "planner/cell_model/time_model.h"
#include "tests/planner/workpieces.h"

namespace hilbrush {
namespace {

void expect_time_model(const CellDescription& cell) {
  const StepCost cost(cell);
  constexpr unsigned kSeed = 3;
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  int rounded_apart = 0;
  constexpr int kMoves = 20'000;
  for (int n = 0; n < kMoves; ++n) {
    const double scale = std::pow(10., 2 * uniform(random) - 2);
    Joints from = home_joints(cell);
    Joints to = from;
    for (std::size_t i = 0; i < 4; ++i) to[i] += scale * uniform(random) * (i == kJ3 ? .1 : 1);
    const double expected_s = move_s(cell, from, to) + settle_s(cell, from, to) - cell.timing.settle_min_s;
    const double off_s = std::abs(static_cast<double>(cost(arm_of(from), arm_of(to))) - expected_s);
    // Single precision may round to the tick next to it, not often.
    if (off_s > 1e-5) ++rounded_apart;
    EXPECT_LT(off_s, cell.timing.tick_s + 1e-5) << "seed " << kSeed << ", move " << n;
  }
  EXPECT_LT(rounded_apart, kMoves / 500);
}

TEST(StepCost, IsTheTimeModel) {
  CellDescription cell = default_cell();
  expect_time_model(cell);
  cell.motion.robot = Interpolation::kCoordinated;
  expect_time_model(cell);
  cell.axes[kJ2].time_factor = 1.3;
  expect_time_model(cell);
}

/// Steps on a plate at rest: with_turn() against the joints of many turns, solved.
TEST(StepCost, WithATurnIsTheLeastOverTurnsAndSymmetric) {
  const CellDescription cell = default_cell();
  const Kinematics kinematics(cell);
  const StepCost cost(cell);
  constexpr unsigned kSeed = 5;
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  int helped = 0;
  int apart = 0;
  constexpr int kSteps = 2000;
  for (int n = 0; n < kSteps; ++n) {
    const Eigen::Vector3d from_W(.26 + .03 * uniform(random), .03 * uniform(random), .15);
    const Eigen::Vector3d to_W =
        from_W + 3e-4 * Eigen::Vector3d(uniform(random), uniform(random), .3 * uniform(random));
    const double yaw = std::numbers::pi * uniform(random);
    Joints from{}, to{};
    ASSERT_TRUE(kinematics.solve_arm(from_W, yaw, Elbow::kPositive, from));
    ASSERT_TRUE(kinematics.solve_arm(to_W, yaw, Elbow::kPositive, to));
    to[kJ4] = from[kJ4] + std::remainder(to[kJ4] - from[kJ4], 2 * std::numbers::pi);
    const ArmJoints from_rate = arm_of(kinematics.per_yaw(from)), to_rate = arm_of(kinematics.per_yaw(to));
    const float turned_s = cost.with_turn(arm_of(from), arm_of(to), from_rate, to_rate);
    EXPECT_EQ(turned_s, cost.with_turn(arm_of(to), arm_of(from), to_rate, from_rate)) << "step " << n;
    const float plain_s = cost(arm_of(from), arm_of(to));
    EXPECT_LE(turned_s, plain_s);
    // Asked whether it costs less than so much, it says what it costs if it does, else no less than that and
    // no more.
    for (const float enough_s : {.5F * turned_s, .99F * turned_s, 1.01F * turned_s, 2 * turned_s}) {
      const float told_s = cost.with_turn(arm_of(from), arm_of(to), from_rate, to_rate, 1, enough_s);
      if (turned_s < enough_s)
        EXPECT_EQ(told_s, turned_s) << "step " << n;
      else
        EXPECT_TRUE(told_s >= enough_s && told_s <= turned_s) << "step " << n;
    }
    helped += turned_s < plain_s - 1e-3F;
    float least_s = plain_s;
    for (int t = -200; t <= 200; ++t) {
      Joints turned = from;
      ASSERT_TRUE(kinematics.solve_arm(to_W, yaw + 5e-5 * t, Elbow::kPositive, turned));
      turned[kJ4] = from[kJ4] + std::remainder(turned[kJ4] - from[kJ4], 2 * std::numbers::pi);
      least_s = std::min(least_s, cost(arm_of(from), arm_of(turned)));
    }
    // Ticks are decided by the slowest axis; what settling adds may be a little less elsewhere.
    apart += std::abs(turned_s - least_s) > 1e-3F;
  }
  EXPECT_GT(helped, kSteps / 20);
  EXPECT_LT(apart, kSteps / 50);
}

}  // namespace
}  // namespace hilbrush
