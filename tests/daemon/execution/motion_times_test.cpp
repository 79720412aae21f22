#include "daemon/execution/motion_times.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "planner/cell_model/time_model.h"

namespace hilbrush {
namespace {

CellDescription plain_cell() {
  CellDescription cell;
  for (AxisDescription& axis : cell.axes) axis.speed_max = 5, axis.acceleration_max = 50;
  return cell;
}

/// Moves of one axis each, the n-th by a length of its own.
MotionTimes moves(const CellDescription& cell, int count, double delay_s, double factor_of_j2,
                  unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> length(.001, .5);
  MotionTimes times;
  for (int n = 0; n < count; ++n) {
    Joints from{}, to{};
    const auto axis = static_cast<std::size_t>(n % 3);
    to[axis] = length(random);
    const double factor = axis == kJ2 ? factor_of_j2 : 1;
    times.add(cell, from, to, delay_s + factor * trapezoid_s(to[axis], 5, 50));
  }
  return times;
}

TEST(MotionTimes, TellDelayAndFactorsApart) {
  const CellDescription cell = plain_cell();
  MotionTimes times = moves(cell, 300, .0015, 1.25, 1);
  times.add(moves(cell, 150, .0015, 1.25, 2));
  EXPECT_EQ(times.count(), 450u);
  const auto measured = times.measured();
  ASSERT_TRUE(measured);
  EXPECT_NEAR(measured->move_delay_s, .0015, 1e-9);
  EXPECT_NEAR(measured->time_factor[kJ1].value(), 1, 1e-9);
  EXPECT_NEAR(measured->time_factor[kJ2].value(), 1.25, 1e-9);
  EXPECT_FALSE(measured->time_factor[kTilt]) << "it never moved";
}

TEST(MotionTimes, AreNotToldOfTooFewMoves) {
  EXPECT_FALSE(moves(plain_cell(), 90, 0, 1, 3).measured());
  const auto few = moves(plain_cell(), 120, 0, 1, 3).measured();
  ASSERT_TRUE(few);
  EXPECT_FALSE(few->is_enough()) << "looked at, but not for a cell file";
  const auto many = moves(plain_cell(), 5000, 0, 1, 3).measured();
  ASSERT_TRUE(many);
  EXPECT_TRUE(many->is_enough());
}

TEST(MotionTimes, EqualMovesHaveAFactorAndNoDelay) {
  const CellDescription cell = plain_cell();
  MotionTimes times;
  for (int n = 0; n < 200; ++n) times.add(cell, {}, {.1}, 2 * trapezoid_s(.1, 5, 50));
  const auto measured = times.measured();
  ASSERT_TRUE(measured);
  EXPECT_EQ(measured->move_delay_s, 0);
  EXPECT_NEAR(measured->time_factor[kJ1].value(), 2, 1e-9);
}

TEST(MotionTimes, ArrivalsWithTheTickAreNoDelay) {
  CellDescription cell = plain_cell();
  cell.timing.tick_s = .004;
  MotionTimes times;
  for (int n = 1; n < 200; ++n) {
    const Joints to{1e-4 * n};
    times.add(cell, {}, to, move_s(cell, {}, to));
  }
  const auto measured = times.measured();
  ASSERT_TRUE(measured);
  EXPECT_NEAR(measured->move_delay_s, 0, 1e-9);
  EXPECT_NEAR(measured->time_factor[kJ1].value(), 1, 1e-9);
}

TEST(MotionTimes, FactorsInTheCellFileDecideWhichAxisIsTheSlowest) {
  CellDescription cell = plain_cell();
  const Joints to{.1, .09};
  EXPECT_NEAR(move_s(cell, {}, to), trapezoid_s(.1, 5, 50), 1e-12);
  cell.axes[kJ2].time_factor = 3;
  EXPECT_NEAR(move_s(cell, {}, to), 3 * trapezoid_s(.09, 5, 50), 1e-12);
}

}  // namespace
}  // namespace hilbrush
