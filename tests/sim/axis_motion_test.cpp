#include "sim/devices/axis_motion.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

namespace hilbrush {
namespace {

/// Rest to rest over a distance: the textbook trapezoid, or triangle where the speed is never reached.
double trapezoid_duration(double distance, double speed_max, double acceleration) {
  const double ramp = speed_max * speed_max / acceleration;
  return distance < ramp ? 2 * std::sqrt(distance / acceleration)
                         : distance / speed_max + speed_max / acceleration;
}

TEST(AxisMotion, LastsAsLongAsTheClosedForm) {
  for (const double distance : {1e-9, 1e-4, .1, 1., 1.0001, 30.})
    for (const double sign : {1., -1.}) {
      const AxisMotion motion = AxisMotion(.5).move_to(.5 + sign * distance, 2, 1, 1);
      EXPECT_NEAR(motion.end_s() - 2, trapezoid_duration(distance, 1, 1), 1e-9) << distance;
      EXPECT_EQ(motion.position(1), .5);
      EXPECT_EQ(motion.position(motion.end_s()), .5 + sign * distance);
      const double middle = .5 * (2 + motion.end_s());
      EXPECT_NEAR(motion.position(middle), .5 + sign * distance / 2, 1e-9 * distance + 1e-15);  // symmetric
    }
}

TEST(AxisMotion, NoDistanceTakesNoTime) {
  const AxisMotion motion = AxisMotion(.3).move_to(.3, 7, 1, 1);
  EXPECT_EQ(motion.end_s(), 7);
  EXPECT_EQ(motion.position(7), .3);
  EXPECT_EQ(motion.speed(7), 0);
}

/// Position and speed are continuous, speed and acceleration stay within limits, over any mixture of moves
/// and stops.
TEST(AxisMotion, StaysContinuousAndWithinLimitsThroughMovesAndStops) {
  for (unsigned seed = 1; seed <= 50; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(0, 1);
    const double speed_max = .1 + 5 * uniform(random);
    const double acceleration = 1 + 50 * uniform(random);
    AxisMotion motion(uniform(random));
    double now = 0;
    for (int i = 0; i < 20; ++i) {
      const AxisMotion before = motion;
      motion = uniform(random) < .4 ? before.brake(now, acceleration)
                                    : before.move_to(4 * uniform(random) - 2, now, speed_max, acceleration);
      ASSERT_NEAR(before.position(now), motion.position(now), 1e-12) << "seed " << seed;
      ASSERT_NEAR(before.speed(now), motion.speed(now), 1e-9) << "seed " << seed;
      const double until = now + .7 * uniform(random);
      const double step = 1e-3;
      for (double t = now; t < until; t += step) {
        ASSERT_LE(std::abs(motion.speed(t)), speed_max * (1 + 1e-9)) << "seed " << seed;
        ASSERT_LE(std::abs(motion.speed(t + step) - motion.speed(t)), acceleration * step * (1 + 1e-6) + 1e-9)
            << "seed " << seed;
        ASSERT_LE(std::abs(motion.position(t + step) - motion.position(t)),
                  speed_max * step * (1 + 1e-6) + 1e-9)
            << "seed " << seed;
      }
      now = until;
    }
  }
}

/// From rest, and from the middle of another move: then all brake before they go on together.
TEST(AxisMotion, CoordinatedAxesRunStraightWithinTheirLimits) {
  const std::array<AxisLimits, 3> limits{{{1, 10}, {.5, 30}, {4, 8}}};
  for (unsigned seed = 1; seed <= 50; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> place(-1, 1);
    std::array<AxisMotion, 3> motions;
    double now = 1;
    for (int n = 0; n < 4; ++n) {
      const std::array<AxisMotion, 3> before = motions;
      std::array<double, 3> target{place(random), place(random), seed % 5 == 0 ? 0 : place(random)};
      move_coordinated(motions, target, limits, now);
      double end_s = now;
      double go_s = now;  // all have braked
      for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(motions[i].position(now), before[i].position(now), 1e-12);
        end_s = std::max(end_s, motions[i].end_s());
        go_s = std::max(go_s, before[i].brake(now, limits[i].acceleration).end_s());
      }
      const double dt = 1e-4;
      for (double t = now; t < end_s; t += 1e-2) {
        const double share =
            (motions[0].position(t) - motions[0].position(go_s)) / (target[0] - motions[0].position(go_s));
        for (std::size_t i = 0; i < 3; ++i) {
          EXPECT_LE(std::abs(motions[i].speed(t)), limits[i].speed_max * (1 + 1e-9)) << "seed " << seed;
          EXPECT_LE(std::abs(motions[i].speed(t + dt) - motions[i].speed(t)),
                    limits[i].acceleration * dt * (1 + 1e-6))
              << "seed " << seed;
          if (t > go_s) {
            EXPECT_NEAR(motions[i].position(t),
                        motions[i].position(go_s) + share * (target[i] - motions[i].position(go_s)), 1e-9)
                << "seed " << seed;
          }
        }
      }
      for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(motions[i].position(end_s), target[i]);
      now = n % 2 == 0 ? end_s + .1 : now + .3 * (end_s - now);
    }
  }
}

TEST(AxisMotion, BrakingTakesSpeedOverAcceleration) {
  const AxisMotion moving = AxisMotion(0).move_to(10, 0, 2, 4);
  const AxisMotion braking = moving.brake(3, 4);
  EXPECT_NEAR(braking.end_s() - 3, 2. / 4, 1e-12);
  EXPECT_NEAR(braking.target() - moving.position(3), 2. * 2 / (2 * 4), 1e-12);
}

}  // namespace
}  // namespace hilbrush
