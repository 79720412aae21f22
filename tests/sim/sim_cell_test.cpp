#include "sim/devices/sim_cell.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>
#include <vector>

#include "drivers/driver_error.h"
#include "tests/sim/test_objects.h"

namespace hilbrush {
namespace {

/// What a refusal says; empty if there was none.
template <class Call>
std::string refusal(Call call) {
  try {
    call();
  } catch (const DriverError& error) {
    return error.what();
  }
  return {};
}

/// A cell with everything switched on.
struct ReadyCell {
  explicit ReadyCell(double time_scale = 0, double start_delay_s = 5)
      : description(with_time_scale(time_scale)),
        sim(description, {.laser_start_delay_s = start_delay_s}),
        cell(sim.cell()) {
    sim.set_emission_sink([this](const Emission& emission) { emissions.push_back(emission); });
    cell.robot.connect(), cell.robot.enable(), cell.robot.home();
    cell.table.connect(), cell.table.enable(), cell.table.home();
    cell.laser.connect(), cell.laser.enable();
  }
  static CellDescription with_time_scale(double time_scale) {
    CellDescription description = test::handmade_cell();
    description.simulation.time_scale = time_scale;
    return description;
  }
  void wait_for(double duration_s) { cell.clock.sleep_until(cell.clock.now_s() + duration_s); }

  CellDescription description;
  std::vector<Emission> emissions;  // before the cell: a pulse may end in its destructor
  SimCell sim;
  Cell cell;
};

constexpr double kSettle = .12;

TEST(SimCell, StartsDisconnectedWithTheLaserOff) {
  SimCell sim(test::handmade_cell());
  const Cell cell = sim.cell();
  EXPECT_EQ(cell.robot.status().state, DeviceState::kDisconnected);
  EXPECT_EQ(cell.table.status().state, DeviceState::kDisconnected);
  EXPECT_EQ(cell.laser.status().state, DeviceState::kDisconnected);
  EXPECT_FALSE(cell.laser.status().is_emitting);
  EXPECT_FALSE(cell.robot.status().in_position);
  EXPECT_EQ(sim.joints()[kJ3], .2);  // home
  EXPECT_TRUE(cell.laser.off());
}

TEST(SimCell, RefusesWhatItsStateDoesNotAllowInASentence) {
  SimCell sim(test::handmade_cell());
  const Cell cell = sim.cell();
  EXPECT_EQ(refusal([&] { cell.robot.move_to({}, 0); }), "the robot cannot be moved: it is disconnected");
  EXPECT_EQ(refusal([&] { cell.robot.enable(); }), "the robot cannot be enabled: it is disconnected");
  EXPECT_EQ(refusal([&] { cell.robot.home(); }), "the robot cannot be homed: it is disconnected");
  EXPECT_EQ(refusal([&] { cell.robot.clear_fault(); }),
            "the robot cannot be cleared of a fault: it is disconnected");
  EXPECT_EQ(refusal([&] { cell.laser.enable(); }), "the laser cannot be enabled: it is disconnected");
  EXPECT_EQ(refusal([&] { cell.laser.fire(1, .005); }), "the laser cannot be fired: it is disconnected");
  cell.robot.connect();
  EXPECT_EQ(refusal([&] { cell.robot.connect(); }), "the robot cannot be connected: it is connected");
  EXPECT_EQ(refusal([&] { cell.robot.home(); }), "the robot cannot be homed: it is connected");
  cell.robot.enable();
  EXPECT_EQ(refusal([&] { cell.robot.move_to({}, 0); }), "the robot cannot be moved: it is enabled");
  cell.laser.connect();
  EXPECT_EQ(refusal([&] { cell.laser.fire(1, .005); }), "the laser cannot be fired: it is connected");
  cell.robot.disable();
  EXPECT_EQ(cell.robot.status().state, DeviceState::kConnected);
}

TEST(SimCell, AMoveTakesTheSlowestAxisAndThenSettles) {
  ReadyCell ready;
  Robot& robot = ready.cell.robot;
  const double start = ready.cell.clock.now_s();
  robot.move_to({.5, -.2, .25, 1}, kSettle);
  EXPECT_EQ(robot.status().state, DeviceState::kMoving);
  EXPECT_EQ(refusal([&] { robot.move_to({}, 0); }), "the robot cannot be moved: it is moving");

  const double speed = 4 * std::numbers::pi;
  const double acceleration = 8000 * std::numbers::pi / 180;
  const double slowest =
      2 * std::sqrt(1 / acceleration);  // J4 turns by 1 rad and never reaches its top speed
  ASSERT_LT(std::sqrt(acceleration), speed);
  const double move = std::ceil(slowest / .004) * .004;
  EXPECT_NEAR(robot.expected_arrival_s() - start, move + kSettle, 1e-9);
  ready.cell.clock.sleep_until(robot.expected_arrival_s() - 1e-6);
  EXPECT_FALSE(robot.status().in_position);
  ready.cell.clock.sleep_until(robot.expected_arrival_s());
  EXPECT_TRUE(robot.status().in_position);
  EXPECT_EQ(robot.status().state, DeviceState::kReady);
  EXPECT_EQ(robot.status().positions, (Robot::Positions{.5, -.2, .25, 1}));
  EXPECT_EQ(ready.sim.joints()[kJ4], 1);
}

TEST(SimCell, LimitsAreRefusedAtTheDevice) {
  ReadyCell ready;
  const std::string j3 = refusal([&] { ready.cell.robot.move_to({0, 0, .5, 0}, 0); });
  EXPECT_EQ(j3, "the robot refuses to move j3 to 500 mm: its limits are -100 and 400");
  const std::string c = refusal([&] { ready.cell.table.move_to({0, -4}, 0); });
  EXPECT_EQ(c, "the table refuses to move c to -229.1831 degrees: its limits are -180 and 180");
  EXPECT_NE(refusal([&] { ready.cell.robot.move_to({std::nan(""), 0, 0, 0}, 0); }), "");
  EXPECT_NE(refusal([&] { ready.cell.robot.move_to({0, 0, 0, 0}, -1); }), "");
  EXPECT_NE(refusal([&] { ready.cell.robot.move_to({0, 0, 0, 0}, std::nan("")); }), "");
  EXPECT_EQ(ready.cell.robot.status().state, DeviceState::kReady);  // nothing moved
  EXPECT_NE(refusal([&] { ready.cell.laser.fire(20, .005); }), "");
  EXPECT_NE(refusal([&] { ready.cell.laser.fire(1, 5); }), "");
  EXPECT_NE(refusal([&] { ready.cell.laser.fire(std::nan(""), .005); }), "");
  EXPECT_FALSE(ready.cell.laser.status().is_emitting);
}

TEST(SimCell, AStopOnTheWayBrakesAndTheNextMoveGoesOnFromThere) {
  ReadyCell ready;
  Table& table = ready.cell.table;
  table.move_to({0, 3}, kSettle);
  ready.wait_for(.1);
  const double before = table.status().positions[1];
  table.stop();
  table.stop();
  EXPECT_NEAR(table.status().positions[1], before, 1e-12);
  EXPECT_EQ(table.status().state, DeviceState::kReady);
  EXPECT_FALSE(table.status().in_position);
  ready.wait_for(1);
  const double rest = table.status().positions[1];
  EXPECT_GT(rest, before);
  EXPECT_LT(rest, 3);
  EXPECT_FALSE(table.status().in_position);
  table.move_to({0, 0}, kSettle);
  ready.cell.clock.sleep_until(table.expected_arrival_s());
  EXPECT_TRUE(table.status().in_position);
  EXPECT_EQ(table.status().positions[1], 0);
}

TEST(SimCell, AFaultBrakesIsReportedAndCleared) {
  ReadyCell ready;
  ready.cell.robot.move_to({1, 0, .2, 0}, kSettle);
  ready.wait_for(.02);
  ready.sim.fail_robot("axis j1 lost its encoder");
  EXPECT_EQ(ready.cell.robot.status().state, DeviceState::kFault);
  EXPECT_EQ(ready.cell.robot.status().fault, "axis j1 lost its encoder");
  EXPECT_EQ(refusal([&] { ready.cell.robot.move_to({}, 0); }),
            "the robot cannot be moved: it reports a fault: axis j1 lost its encoder");
  ready.cell.robot.clear_fault();
  EXPECT_EQ(ready.cell.robot.status().state, DeviceState::kConnected);
  EXPECT_EQ(ready.cell.robot.status().fault, "");
}

TEST(SimCell, APulseIsTimedByTheDeviceAndRecordedOnce) {
  ReadyCell ready;
  const double start = ready.cell.clock.now_s();
  ready.cell.laser.fire(2, .005);
  EXPECT_TRUE(ready.cell.laser.status().is_emitting);
  EXPECT_EQ(ready.cell.laser.status().state, DeviceState::kMoving);
  EXPECT_EQ(refusal([&] { ready.cell.laser.fire(2, .005); }),
            "the laser cannot be fired: it is still emitting");
  ready.wait_for(.0051);
  EXPECT_FALSE(ready.cell.laser.status().is_emitting);
  EXPECT_TRUE(ready.cell.laser.off());
  ASSERT_EQ(ready.emissions.size(), 1u);
  EXPECT_EQ(ready.emissions[0].start_s, start);
  EXPECT_EQ(ready.emissions[0].length_s, .005);
  EXPECT_EQ(ready.emissions[0].commanded_s, .005);
  EXPECT_EQ(ready.emissions[0].power_w, 2);
  EXPECT_FALSE(ready.emissions[0].is_moving);
  EXPECT_EQ(ready.emissions[0].joints, ready.sim.joints());
}

TEST(SimCell, OffCutsThePulseWithinOneTick) {
  ReadyCell ready;
  ready.cell.laser.fire(1, .5);
  ready.wait_for(.1013);
  const double asked = ready.cell.clock.now_s();
  EXPECT_TRUE(ready.cell.laser.off());
  EXPECT_FALSE(ready.cell.laser.status().is_emitting);
  EXPECT_TRUE(ready.cell.laser.off());
  ASSERT_EQ(ready.emissions.size(), 1u);
  const double end = ready.emissions[0].start_s + ready.emissions[0].length_s;
  EXPECT_GE(end, asked - 1e-9);
  EXPECT_LE(end, asked + ready.description.timing.tick_s + 1e-9);
  EXPECT_EQ(ready.emissions[0].commanded_s, .5);
}

TEST(SimCell, TheInterlockCutsThePulseAtOnceAndLatches) {
  ReadyCell ready;
  ready.cell.laser.fire(1, .5);
  ready.wait_for(.1);
  ready.sim.set_interlock_closed(false);
  ASSERT_EQ(ready.emissions.size(), 1u);
  EXPECT_NEAR(ready.emissions[0].length_s, .1, 1e-9);
  EXPECT_EQ(ready.cell.laser.status().state, DeviceState::kFault);
  EXPECT_EQ(ready.cell.laser.status().fault, "the interlock was opened");
  EXPECT_NE(refusal([&] { ready.cell.laser.clear_fault(); }), "");  // still open
  ready.sim.set_interlock_closed(true);
  EXPECT_EQ(ready.cell.laser.status().state, DeviceState::kFault);
  EXPECT_NE(refusal([&] { ready.cell.laser.fire(1, .005); }), "");
  ready.cell.laser.clear_fault();
  ready.cell.laser.enable();
  ready.cell.laser.fire(1, .005);
}

TEST(SimCell, TheLaserIsNotEnabledWithTheInterlockOpen) {
  SimCell sim(test::handmade_cell());
  Laser& laser = sim.cell().laser;
  laser.connect();
  sim.set_interlock_closed(false);
  EXPECT_EQ(refusal([&] { laser.enable(); }), "the laser cannot be enabled: its interlock is open");
}

TEST(SimCell, EnablingTheLaserPaysItsStartDelayOnTheCellsClock) {
  ReadyCell ready(0, 5);
  EXPECT_NEAR(ready.cell.clock.now_s(), 5, 1e-12);
}

TEST(SimCell, DisablingEndsAStartDelay) {
  CellDescription description = test::handmade_cell();
  description.simulation.time_scale = 1;
  SimCell sim(description, {.laser_start_delay_s = 1000});
  Laser& laser = sim.cell().laser;
  laser.connect();
  std::string said;
  std::thread enabling([&] { said = refusal([&] { laser.enable(); }); });
  while (laser.status().state != DeviceState::kEnabled) std::this_thread::yield();
  laser.disable();
  enabling.join();
  EXPECT_EQ(said, "the laser was turned off again during its start delay");
  EXPECT_EQ(laser.status().state, DeviceState::kConnected);
}

TEST(SimCell, FiringWhileAxesMoveIsOnRecord) {
  ReadyCell ready;
  ready.cell.robot.move_to({.5, 0, .2, 0}, kSettle);
  ready.wait_for(.02);
  ready.cell.laser.fire(1, .005);
  ready.wait_for(.006);
  EXPECT_TRUE(ready.cell.laser.off());
  ASSERT_EQ(ready.emissions.size(), 1u);
  EXPECT_TRUE(ready.emissions[0].is_moving);
}

TEST(SimCell, FiringBeforeTheMechanicsHaveSettledIsOnRecordWhateverTheControllerReports) {
  ReadyCell ready;
  ready.cell.robot.move_to({.5, 0, .2, 0}, 0);  // a settle time that is none
  ready.cell.clock.sleep_until(ready.cell.robot.expected_arrival_s());
  EXPECT_TRUE(ready.cell.robot.status().in_position);
  ready.cell.laser.fire(1, .005);
  ready.wait_for(.2);
  EXPECT_TRUE(ready.cell.laser.off());
  ready.cell.laser.fire(1, .005);
  ready.wait_for(.2);
  EXPECT_TRUE(ready.cell.laser.off());
  ASSERT_EQ(ready.emissions.size(), 2u);
  EXPECT_TRUE(ready.emissions[0].is_moving);
  EXPECT_FALSE(ready.emissions[1].is_moving);
}

TEST(SimCell, MovingOffDuringAPulseIsOnRecord) {
  ReadyCell ready;
  ready.cell.laser.fire(1, .05);
  ready.wait_for(.02);
  ready.cell.table.move_to({.2, 0}, kSettle);
  ready.wait_for(.1);
  EXPECT_TRUE(ready.cell.laser.off());
  // A pulse that has ended by itself before the move is clean, though its status was not read in between.
  ready.wait_for(1);
  ready.cell.laser.fire(1, .05);
  ready.wait_for(.06);
  ready.cell.table.move_to({0, 0}, kSettle);
  ASSERT_EQ(ready.emissions.size(), 2u);
  EXPECT_TRUE(ready.emissions[0].is_moving);
  EXPECT_FALSE(ready.emissions[1].is_moving);
}

TEST(SimCell, APulseThatIsOnWhenTheCellEndsIsRecorded) {
  std::vector<Emission> emissions;
  {
    ReadyCell ready;
    ready.sim.set_emission_sink([&](const Emission& emission) { emissions.push_back(emission); });
    ready.cell.laser.fire(1, .05);
    ready.wait_for(.01);
  }
  ASSERT_EQ(emissions.size(), 1u);
  EXPECT_NEAR(emissions[0].length_s, .01, 1e-9);
}

TEST(SimCell, ARecordThatFailsPutsTheLaserInFault) {
  ReadyCell ready;
  ready.sim.set_emission_sink([](const Emission&) { throw std::runtime_error("disk full"); });
  ready.cell.laser.fire(1, .005);
  ready.wait_for(.01);
  EXPECT_TRUE(ready.cell.laser.off());
  EXPECT_EQ(ready.cell.laser.status().state, DeviceState::kFault);
  EXPECT_EQ(ready.cell.laser.status().fault, "an emission could not be recorded: disk full");
}

TEST(SimCell, VirtualTimeCostsNoTime) {
  ReadyCell ready;
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < 1000; ++i) {
    ready.cell.robot.move_to({i % 2 ? .5 : -.5, 0, .2, 0}, kSettle);
    ready.cell.clock.sleep_until(ready.cell.robot.expected_arrival_s());
    ready.cell.laser.fire(1, .005);
    ready.wait_for(.005);
    EXPECT_TRUE(ready.cell.laser.off());
  }
  EXPECT_EQ(ready.emissions.size(), 1000u);
  EXPECT_GT(ready.cell.clock.now_s(), 100);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(20));
}

TEST(SimCell, ScaledTimeRunsFasterThanTheWall) {
  ReadyCell ready(.001, 1);  // 1 s of start delay in 1 ms
  const double until = ready.cell.clock.now_s() + 5;
  ready.cell.clock.sleep_until(until);
  EXPECT_GE(ready.cell.clock.now_s(), until);
}

TEST(SimCell, AWakeEndsTheExecutorsSleep) {
  ReadyCell ready(1, 0);
  std::thread sleeper([&] { ready.cell.clock.sleep_until(1e6); });
  ready.cell.clock.wake();
  sleeper.join();
}

/// One executor paints while others ask for off, stop and status: nothing tears, and no pulse is recorded
/// longer than commanded or twice.
TEST(SimCell, OffAndStopMayComeFromAnyThread) {
  ReadyCell ready(.001, 0);
  std::atomic<bool> is_done{false};
  std::vector<std::thread> others;
  for (int k = 0; k < 3; ++k)
    others.emplace_back([&, k] {
      while (!is_done) {
        if (k == 0) ready.cell.laser.off();
        if (k == 1) ready.cell.robot.stop(), ready.cell.table.stop();
        if (k == 2)
          (void)ready.cell.robot.status(), (void)ready.cell.laser.status(), (void)ready.sim.joints();
        std::this_thread::sleep_for(std::chrono::microseconds(50));
      }
    });
  int fired = 0;
  for (int i = 0; i < 300; ++i) {
    ready.cell.robot.move_to({i % 2 ? .1 : -.1, 0, .2, 0}, kSettle);
    ready.cell.clock.sleep_until(ready.cell.robot.expected_arrival_s());
    if (!refusal([&] { ready.cell.laser.fire(1, .05); }).empty()) continue;
    ++fired;
    ready.wait_for(.05);
    EXPECT_TRUE(ready.cell.laser.off());
  }
  is_done = true;
  for (std::thread& other : others) other.join();
  ASSERT_EQ(ready.emissions.size(), static_cast<std::size_t>(fired));
  double last_end = 0;
  for (const Emission& emission : ready.emissions) {
    EXPECT_LE(emission.length_s, .05);
    EXPECT_GE(emission.length_s, 0);
    EXPECT_GE(emission.start_s, last_end - 1e-9);
    last_end = emission.start_s + emission.length_s;
  }
}

}  // namespace
}  // namespace hilbrush
