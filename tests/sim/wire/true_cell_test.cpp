#include "sim/wire/true_cell.h"

#include <gtest/gtest.h>

#include <random>

#include "planner/cell_model/time_model.h"
#include "tests/daemon/execution/program_fixture.h"

namespace hilbrush {
namespace {

struct Bench {
  explicit Bench(TrueCellOptions options = {.start_delay_s = 0}) : cell(test::small_cell(), options) {
    cell.set_sink([this](const Emission& emission) { emissions.push_back(emission); });
  }
  void pass(double duration_s) { cell.advance(cell.now_s() + duration_s); }
  TrueCell cell;
  std::vector<Emission> emissions;
};

TEST(TrueCell, AnAxisTakesTheTimeOfTheTimeModelAndSettles) {
  const CellDescription description = test::small_cell();
  std::mt19937 random(11);
  std::uniform_real_distribution<double> place(-1.2, 1.2);
  for (int round = 0; round < 50; ++round) {
    Bench bench;
    const double from = description.axes[kJ1].home;
    const double to = place(random);
    bench.cell.move_axis(kJ1, to);
    const auto& axis = description.axes[kJ1];
    const double rest_s = trapezoid_s(std::abs(to - from), axis.speed_max, axis.acceleration_max);
    const Joints a = home_joints(description);
    Joints b = a;
    b[kJ1] = to;
    EXPECT_NEAR(bench.cell.rest_s(kJ1), rest_s, 1e-9);
    EXPECT_NEAR(bench.cell.settled_s(kJ1), rest_s + settle_s(description, a, b), 1e-9);
    bench.pass(rest_s - 1e-6);
    EXPECT_TRUE(bench.cell.is_moving(kJ1));
    EXPECT_EQ(bench.cell.phase(), CellPhase::kMoving);
    bench.pass(2e-6);
    EXPECT_FALSE(bench.cell.is_moving(kJ1));
    EXPECT_EQ(bench.cell.phase(), CellPhase::kSettling);
    EXPECT_LE(std::abs(bench.cell.position(kJ1) - to), TrueCell::kCreep);
    bench.pass(1);
    EXPECT_EQ(bench.cell.position(kJ1), to);
    EXPECT_EQ(bench.cell.phase(), CellPhase::kSettled);
  }
}

TEST(TrueCell, AChainMovesByTheInterpolationOfItsController) {
  for (const Interpolation interpolation : {Interpolation::kIndependent, Interpolation::kCoordinated}) {
    CellDescription description = test::small_cell();
    description.motion.robot = interpolation;
    TrueCell cell(description, {.start_delay_s = 0});
    const Joints from = home_joints(description);
    Joints to = from;
    to[kJ1] += .4;
    to[kJ2] -= .1;
    to[kJ4] += 1;
    cell.move_chain(kRobotChain, std::span(to).first(4));
    const double end_s = chain_move_s(description, kRobotChain, interpolation, from, to);
    for (double time_s = 0; time_s < 1.2 * end_s; time_s += .01 * end_s) {
      cell.advance(time_s);
      Joints expected = from;
      put_chain(description, kRobotChain, interpolation, from, to, time_s, expected);
      for (std::size_t i = 0; i < kAxisCount; ++i)
        EXPECT_NEAR(cell.profile(i), expected[i], 1e-9) << time_s / end_s;
    }
  }
}

TEST(TrueCell, BrakingStopsShortAndKeepsItsSettling) {
  Bench bench;
  bench.cell.move_axis(kRotation, 3);
  bench.pass(.2);
  bench.cell.brake_axis(kRotation);
  EXPECT_TRUE(bench.cell.is_moving(kRotation));
  bench.pass(.2);
  EXPECT_FALSE(bench.cell.is_moving(kRotation));
  EXPECT_LT(bench.cell.position(kRotation), 2);
  bench.pass(.2);
  EXPECT_TRUE(bench.cell.is_settled());
}

TEST(TrueCell, LightIsOneEmissionFromGateToGate) {
  Bench bench;
  bench.cell.set_modulation(TrueCell::Modulation::kWired);
  bench.cell.set_power(.02);
  bench.cell.set_gate(true, .005);
  bench.pass(.005);
  bench.cell.set_gate(false);
  EXPECT_TRUE(bench.emissions.empty()) << "emission was not ordered";

  EXPECT_TRUE(bench.cell.set_emission(true));
  EXPECT_FALSE(bench.cell.is_emitting());
  bench.cell.set_gate(true, .005);
  EXPECT_TRUE(bench.cell.is_emitting());
  EXPECT_EQ(bench.cell.phase(), CellPhase::kPulse);
  bench.pass(.005);
  bench.cell.set_gate(false);
  ASSERT_EQ(bench.emissions.size(), 1u);
  EXPECT_EQ(bench.emissions[0].length_s, .005);
  EXPECT_EQ(bench.emissions[0].commanded_s, .005);
  EXPECT_EQ(bench.emissions[0].power_w, .02);
  EXPECT_EQ(bench.emissions[0].joints, bench.cell.joints());
  EXPECT_FALSE(bench.emissions[0].is_moving);
}

TEST(TrueCell, TheStartDelayEndsAtItsOwnInstant) {
  Bench bench({.start_delay_s = 5});
  bench.cell.set_modulation(TrueCell::Modulation::kWired);
  bench.cell.set_gate(true);
  bench.cell.set_emission(true);
  bench.pass(4.9);
  EXPECT_FALSE(bench.cell.is_emitting());
  EXPECT_TRUE(bench.cell.is_in_start_delay());
  bench.pass(3);  // looked at late
  EXPECT_TRUE(bench.cell.is_emitting());
  bench.cell.set_emission(false);
  ASSERT_EQ(bench.emissions.size(), 1u);
  EXPECT_EQ(bench.emissions[0].start_s, 5);
  EXPECT_NEAR(bench.emissions[0].length_s, 2.9, 1e-12);
}

TEST(TrueCell, InterlockAndKeyCutTheLightAtOnceAndLatch) {
  for (const bool by_key : {false, true}) {
    Bench bench;
    bench.cell.set_emission(true);
    EXPECT_TRUE(bench.cell.is_emitting());
    bench.pass(.003);
    by_key ? bench.cell.set_key(false) : bench.cell.set_interlock(false);
    EXPECT_FALSE(bench.cell.is_emitting());
    EXPECT_TRUE(bench.cell.is_tripped());
    EXPECT_FALSE(bench.cell.set_emission(true));
    by_key ? bench.cell.set_key(true) : bench.cell.set_interlock(true);
    EXPECT_FALSE(bench.cell.is_emitting()) << "only a new order brings light back";
    EXPECT_TRUE(bench.cell.set_emission(true));
    EXPECT_TRUE(bench.cell.is_emitting());
    EXPECT_NEAR(bench.emissions.at(0).length_s, .003, 1e-12);
  }
}

TEST(TrueCell, LightWhileAnAxisMovesOrSettlesIsOnRecord) {
  Bench bench;
  bench.cell.set_modulation(TrueCell::Modulation::kWired);
  bench.cell.set_emission(true);
  const auto pulse = [&] {
    bench.cell.set_gate(true);
    bench.pass(.001);
    bench.cell.set_gate(false);
    return bench.emissions.back().is_moving;
  };
  EXPECT_FALSE(pulse());
  bench.cell.move_axis(kTilt, .3);
  EXPECT_TRUE(pulse());
  bench.cell.advance(bench.cell.rest_s(kTilt) + .001);
  EXPECT_TRUE(pulse()) << "at rest, not settled";
  bench.pass(.2);
  EXPECT_FALSE(pulse());
  bench.cell.set_gate(true);
  bench.cell.move_axis(kJ4, 1);
  bench.cell.set_gate(false);
  EXPECT_TRUE(bench.emissions.back().is_moving) << "moved off while the light was on";
}

TEST(TrueCell, AJammedAxisNeverArrivesAndADriftIsOnRecordOnceItCouldBeSeen) {
  Bench bench;
  bench.cell.move_axis(kJ1, 1);
  bench.pass(.05);
  bench.cell.jam_axis(kJ1);
  const double here = bench.cell.position(kJ1);
  bench.pass(5);
  EXPECT_EQ(bench.cell.position(kJ1), here);
  EXPECT_TRUE(bench.cell.is_moving(kJ1)) << "its controller still waits for it";
  bench.cell.free_axis(kJ1);
  EXPECT_FALSE(bench.cell.is_moving(kJ1));
  bench.cell.move_axis(kJ1, 1);
  bench.pass(5);
  EXPECT_EQ(bench.cell.position(kJ1), 1);

  bench.cell.drift_axis(kJ1, .01);
  bench.pass(.01);
  EXPECT_TRUE(bench.cell.is_settled()) << "too little to see";
  for (int i = 0; i < 10; ++i) bench.pass(.01);
  EXPECT_NEAR(bench.cell.position(kJ1), 1.0011, 1e-9);
  EXPECT_FALSE(bench.cell.is_settled());
  bench.cell.drift_axis(kJ1, 0);
  bench.cell.move_axis(kJ1, 1);
  bench.pass(1);
  EXPECT_EQ(bench.cell.position(kJ1), 1);
  EXPECT_TRUE(bench.cell.is_settled());
}

TEST(TrueCell, ALowerLimitBringsThePowerDown) {
  Bench bench;
  bench.cell.set_power(.1);
  bench.cell.set_emission(true);
  bench.pass(.01);
  bench.cell.set_power_max(.05);
  bench.pass(.01);
  bench.cell.disarm();
  ASSERT_EQ(bench.emissions.size(), 2u);
  EXPECT_EQ(bench.emissions[0].power_w, .1);
  EXPECT_EQ(bench.emissions[1].power_w, .05);
}

}  // namespace
}  // namespace hilbrush
