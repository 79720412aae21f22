#include "planner/cell_model/time_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "planner/plan.h"
#include "tests/planner/workpieces.h"

namespace hilbrush {
namespace {

TEST(TimeModel, TrapezoidClosedForms) {
  EXPECT_EQ(trapezoid_s(0, 2, 4), 0);
  EXPECT_DOUBLE_EQ(trapezoid_s(.25, 2, 4),
                   2 * std::sqrt(.25 / 4));             // a triangle: full speed is never reached
  EXPECT_DOUBLE_EQ(trapezoid_s(1, 2, 4), 1);            // just reached: .5 s up, .5 s down
  EXPECT_DOUBLE_EQ(trapezoid_s(5, 2, 4), .5 + 2 + .5);  // and 4 m at 2 m/s between
}

TEST(TimeModel, MoveIsTheSlowestAxisInWholeTicks) {
  const CellDescription cell = default_cell();
  const Joints home = home_joints(cell);
  EXPECT_EQ(move_s(cell, home, home), 0);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> share(0, 1);
  for (int n = 0; n < 1000; ++n) {
    Joints to = home;
    double slowest = 0;
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      to[i] = cell.axes[i].min + share(random) * (cell.axes[i].max - cell.axes[i].min);
      slowest = std::max(slowest, trapezoid_s(std::abs(to[i] - home[i]), cell.axes[i].speed_max,
                                              cell.axes[i].acceleration_max));
    }
    const double move = move_s(cell, home, to);
    const double ticks = move / cell.timing.tick_s;
    EXPECT_GE(move, slowest - 1e-9);
    EXPECT_LT(move, slowest + cell.timing.tick_s);
    EXPECT_NEAR(ticks, std::round(ticks), 1e-6);
    // The joints on the way agree with the time it takes.
    const Joints end = joints_during(cell, home, to, move);
    for (std::size_t i = 0; i < kAxisCount; ++i) EXPECT_NEAR(end[i], to[i], 1e-12);
  }
}

TEST(TimeModel, JointsDuringAMoveKeepSpeedAndAcceleration) {
  const CellDescription cell = default_cell();
  Joints from = home_joints(cell);
  Joints to = from;
  to[kJ1] -= 1, to[kJ3] -= .2, to[kRotation] += 2;
  const double dt = 1e-4;
  for (double t = dt; t < 1; t += dt) {
    const Joints a = joints_during(cell, from, to, t - dt);
    const Joints b = joints_during(cell, from, to, t);
    const Joints c = joints_during(cell, from, to, t + dt);
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      EXPECT_LE(std::abs(b[i] - a[i]) / dt, cell.axes[i].speed_max * (1 + 1e-6));
      EXPECT_LE(std::abs(c[i] - 2 * b[i] + a[i]) / (dt * dt), cell.axes[i].acceleration_max * (1 + 1e-3));
    }
  }
}

/// A straight line in joint space, as fast as the limits allow: some joint of each chain is at one of them at
/// any time.
TEST(TimeModel, CoordinatedJointsRunStraightAndArriveTogether) {
  CellDescription cell = default_cell();
  cell.axes[kJ2].time_factor = 1.5;
  constexpr unsigned kSeed = 8;
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> share(0, 1);
  for (int n = 0; n < 200; ++n) {
    const Joints from = home_joints(cell);
    Joints to = from;
    const double scale = std::pow(10., -3 * share(random));
    for (std::size_t i = 0; i < kAxisCount; ++i)
      to[i] += scale * (cell.axes[i].min + share(random) * (cell.axes[i].max - cell.axes[i].min) - from[i]);
    for (const Chain chain : {kRobotChain, kTableChain}) {
      const double end_s = chain_move_s(cell, chain, Interpolation::kCoordinated, from, to);
      EXPECT_GE(end_s, chain_move_s(cell, chain, Interpolation::kIndependent, from, to) * (1 - 1e-12));
      const auto at = [&](double time_s) {
        Joints joints = from;
        put_chain(cell, chain, Interpolation::kCoordinated, from, to, time_s, joints);
        return joints;
      };
      const double dt = 1e-4 * end_s;
      const double factor = chain.first == kJ1 ? 1.5 : 1;
      for (double t = dt; t < end_s - dt; t += .02 * end_s) {
        const Joints a = at(t - dt);
        const Joints b = at(t);
        const Joints c = at(t + dt);
        double used = 0;  // of what the limits allow
        for (std::size_t i = chain.first; i < chain.first + chain.count; ++i) {
          EXPECT_NEAR((b[i] - from[i]) * (to[chain.first] - from[chain.first]),
                      (to[i] - from[i]) * (b[chain.first] - from[chain.first]), 1e-12);
          const double speed = factor * std::abs(c[i] - a[i]) / (2 * dt) / cell.axes[i].speed_max;
          const double acceleration =
              factor * factor * std::abs(c[i] - 2 * b[i] + a[i]) / (dt * dt) / cell.axes[i].acceleration_max;
          EXPECT_LE(speed, 1 + 1e-6) << "seed " << kSeed;
          EXPECT_LE(acceleration, 1 + 1e-3) << "seed " << kSeed;
          used = std::max({used, speed, acceleration});
        }
        EXPECT_GT(used, .49) << "seed " << kSeed << ", move " << n << " at "
                             << t / end_s;  // .5 where it turns
      }
      const Joints end = at(end_s * (1 + 1e-12));
      const Joints before = at(end_s * .999);
      for (std::size_t i = chain.first; i < chain.first + chain.count; ++i) {
        EXPECT_EQ(end[i], to[i]);
        EXPECT_NE(before[i], to[i]);
      }
      EXPECT_EQ(at(-1), from);
    }
  }
}

TEST(TimeModel, MoveFollowsTheInterpolation) {
  CellDescription cell = default_cell();
  const Joints from = home_joints(cell);
  Joints to = from;
  to[kJ1] -= .5;  // slow to accelerate
  to[kJ3] -= .2;  // slow to travel
  const double independent_s = move_s(cell, from, to);
  EXPECT_EQ(cell.motion.robot, Interpolation::kUnknown);
  cell.motion.robot = Interpolation::kIndependent;
  EXPECT_EQ(move_s(cell, from, to), independent_s);
  cell.motion.robot = Interpolation::kCoordinated;
  EXPECT_GE(move_s(cell, from, to), independent_s);
  EXPECT_NEAR(move_s(cell, from, to), chain_move_s(cell, kRobotChain, Interpolation::kCoordinated, from, to),
              cell.timing.tick_s);
}

TEST(TimeModel, SettleGrowsUpToItsCap) {
  const CellDescription cell = default_cell();
  const auto& timing = cell.timing;
  const Joints from = home_joints(cell);
  EXPECT_EQ(settle_s(cell, from, from), timing.settle_min_s);
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    Joints to = from;
    to[i] += .5 * cell.axes[i].settle_saturation;
    EXPECT_NEAR(settle_s(cell, from, to), .5 * (timing.settle_min_s + timing.settle_max_s), 1e-12);
    to[i] += 10 * cell.axes[i].settle_saturation;
    EXPECT_EQ(settle_s(cell, from, to), timing.settle_max_s);
  }
}

TEST(TimeModel, EstimateAddsUpMovesSettlesAndPulses) {
  const CellDescription cell = default_cell();
  const Joints home = home_joints(cell);
  ExposureProgram program;
  Exposure exposure;
  exposure.joints = home;
  exposure.joints[kJ1] -= .3;
  exposure.pulse_s = .005F;
  program.exposures = {exposure, exposure};
  Joints via = home;
  via[kJ3] -= .05;
  program.vias = {{0, home}, {1, via}, {2, home}};
  const TimeSplit time = estimate_time(cell, program);
  EXPECT_NEAR(time.expose_s, .01, 1e-9);
  EXPECT_NEAR(time.settle_s, 2 * cell.timing.settle_max_s, 1e-9);
  EXPECT_NEAR(time.move_s + time.retract_s,
              2 * move_s(cell, home, exposure.joints) + 2 * move_s(cell, exposure.joints, via), 1e-9);
}

}  // namespace
}  // namespace hilbrush
