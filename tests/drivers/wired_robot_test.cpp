#include <cmath>

#include "tests/drivers/wired_cell.h"

/// The robot's driver and its gate against a simulated controller that misbehaves.
namespace hilbrush::test {
namespace {

class WiredRobot : public testing::Test {
 protected:
  WiredRobot() {
    cell.laser->connect();
    WiredCell::make_ready(*cell.robot);
    home = cell.robot->status().positions;
  }
  Robot::Positions beside(double step) const {
    Robot::Positions target = home;
    target[0] += step;
    return target;
  }
  void order(const WireFaultKind kind, double duration_s = 60) {
    cell.begin_fault(kind, WireDevice::kRobot, duration_s);
  }
  bool is_robot_moving() {
    bool is_moving = false;
    cell.wire.act([&](TrueCell& truth) { is_moving = truth.is_moving(kJ1); });
    return is_moving;
  }

  WiredCell cell;
  Robot::Positions home{};
};

TEST_F(WiredRobot, TakesTargetsAheadAndArrivesAtTheLast) {
  for (const double step : {.1, .2, .15})
    cell.robot->move_to(beside(step), cell.description.timing.settle_max_s);
  ASSERT_TRUE(cell.wait_for([&] { return cell.robot->status().in_position; }));
  EXPECT_NEAR(cell.robot->status().positions[0], home[0] + .15, 1e-5);
  cell.wire.act([&](TrueCell& truth) { EXPECT_TRUE(truth.is_settled(kJ1)); });
}

TEST_F(WiredRobot, RefusesMoreTargetsAheadThanItSays) {
  for (std::size_t i = 0; i <= cell.robot->look_ahead(); ++i)
    cell.robot->move_to(beside(.3 + .01 * static_cast<double>(i)), .02);
  EXPECT_THROW(cell.robot->move_to(beside(.1), .02), DriverError);
  cell.robot->stop();
  cell.robot->move_to(beside(.1), .02);
  EXPECT_TRUE(cell.wait_for([&] { return cell.robot->status().in_position; }));
}

TEST_F(WiredRobot, AStopForgetsWhatWasAhead) {
  for (const double step : {.5, -.5}) cell.robot->move_to(beside(step), .02);
  ASSERT_TRUE(cell.wait_for([&] { return is_robot_moving(); }));
  cell.robot->stop();
  EXPECT_TRUE(cell.wait_for([&] { return !is_robot_moving(); }, 2));
  EXPECT_FALSE(cell.robot->status().in_position);
  cell.robot->move_to(beside(.01), .02);
  EXPECT_TRUE(cell.wait_for([&] { return cell.robot->status().in_position; }));
}

TEST_F(WiredRobot, AStaleReportIsNoArrival) {
  order(WireFaultKind::kStaleInPosition, 2);
  cell.robot->move_to(beside(.5), .02);
  const double begun_s = cell.clock.now_s();
  while (cell.clock.now_s() < begun_s + 1.5) {
    if (cell.robot->status().in_position) {
      EXPECT_FALSE(is_robot_moving());
    }
    cell.clock.sleep_until(cell.clock.now_s() + .01);
  }
}

TEST_F(WiredRobot, RefusesWhatIsOutsideItsLimits) {
  EXPECT_THROW(cell.robot->move_to(beside(10), .02), DriverError);
  EXPECT_THROW(cell.robot->move_to(beside(std::nan("")), .02), DriverError);
  EXPECT_THROW(cell.robot->move_to(home, -1), DriverError);
  EXPECT_THROW(cell.robot->move_to(home, std::nan("")), DriverError);
}

TEST_F(WiredRobot, AnAlarmIsAFaultThatCanBeCleared) {
  cell.robot->move_to(beside(.5), .02);
  order(WireFaultKind::kDeviceAlarm);
  ASSERT_TRUE(cell.wait_for([&] { return cell.robot->status().state == DeviceState::kFault; }));
  EXPECT_THROW(cell.robot->move_to(home, .02), DriverError);
  cell.wire.clear_faults();
  cell.robot->clear_fault();
  cell.robot->enable();
  cell.robot->home();
  cell.robot->move_to(home, .02);
  EXPECT_TRUE(cell.wait_for([&] { return cell.robot->status().in_position; }));
}

TEST_F(WiredRobot, ALostLinkIsAFaultThatSaysWhatWasSaidLast) {
  WireFault fault;
  fault.kind = WireFaultKind::kDroppedConnection;
  fault.device = WireDevice::kRobot;
  fault.trigger.at_message = cell.wire.message_count(WireDevice::kRobot) + 1;
  fault.duration_s = 60;
  cell.wire.add_fault(fault);
  EXPECT_THROW(
      {
        for (int i = 0; i < 3; ++i) cell.robot->move_to(beside(.01 * i), .02);
      },
      DriverError);
  ASSERT_TRUE(cell.wait_for([&] { return cell.robot->status().state == DeviceState::kFault; }));
  EXPECT_NE(cell.robot->status().fault.find("last messages: "), std::string::npos)
      << cell.robot->status().fault;
}

TEST_F(WiredRobot, ALinkThatIsLostAtRestIsAFaultThatCanBeCleared) {
  order(WireFaultKind::kDroppedConnection);
  ASSERT_TRUE(cell.wait_for([&] { return cell.robot->status().state == DeviceState::kFault; }, 2));
  EXPECT_NE(cell.robot->status().fault.find("hung up"), std::string::npos) << cell.robot->status().fault;
  cell.wire.clear_faults();
  cell.robot->clear_fault();
  cell.robot->enable();
  cell.robot->home();
  cell.robot->move_to(home, .02);
  EXPECT_TRUE(cell.wait_for([&] { return cell.robot->status().in_position; }));
}

TEST_F(WiredRobot, APulseNeedsARobotInPosition) {
  Gate& gate = cell.robot->gate(1);
  cell.robot->move_to(beside(.5), .02);
  EXPECT_THROW(gate.pulse(.005), DriverError);
  ASSERT_TRUE(cell.wait_for([&] { return cell.robot->status().in_position; }));
  EXPECT_THROW(gate.pulse(.0055), DriverError) << "whole milliseconds only";
  EXPECT_THROW(gate.pulse(0), DriverError);
  EXPECT_THROW(gate.pulse(1e9), DriverError);
  EXPECT_FALSE(gate.is_on());
}

TEST_F(WiredRobot, TheNextPowerIsSetInTheDark) {
  EXPECT_THROW(cell.laser->prepare(.03, .005), DriverError) << "it is not armed";
  cell.laser->enable();
  cell.robot->move_to(beside(.5), .02);
  cell.laser->prepare(.03, .005);
  cell.wire.act([](TrueCell& truth) {
    EXPECT_NEAR(truth.power_w(), .03, 1e-6);
    EXPECT_FALSE(truth.is_emitting());
  });
  EXPECT_THROW(cell.laser->prepare(100, .005), DriverError);
  ASSERT_TRUE(cell.wait_for([&] { return cell.robot->status().in_position; }));
  EXPECT_TRUE(cell.emissions().empty());
}

TEST_F(WiredRobot, APulseThatItRefusesLeavesNothingBehind) {
  cell.laser->enable();
  cell.robot->move_to(beside(.5), .02);
  EXPECT_THROW(cell.laser->fire(.05, .005), DriverError) << "under way";
  ASSERT_TRUE(cell.wait_for([&] { return cell.robot->status().in_position; }));
  ASSERT_TRUE(cell.wait_for([&] { return cell.laser->status().state == DeviceState::kReady; }));
  EXPECT_FALSE(cell.laser->status().is_emitting);
  cell.laser->fire(.05, .005);
  ASSERT_TRUE(cell.wait_for([&] { return !cell.laser->status().is_emitting; }));
  EXPECT_EQ(cell.emissions().size(), 1u);
}

/// The controller takes the on and the wait, and neither hears nor answers the rest.
TEST_F(WiredRobot, ALostEndOfAPulseIsSeenInTheFrames) {
  cell.laser->enable();
  cell.robot->move_to(beside(.01), .02);
  ASSERT_TRUE(cell.wait_for([&] { return cell.robot->status().in_position; }));
  WireFault fault;
  fault.kind = WireFaultKind::kLostRequest;
  fault.device = WireDevice::kRobot;
  fault.trigger.at_message = cell.wire.message_count(WireDevice::kRobot) + 3;
  fault.messages = 2;
  cell.wire.add_fault(fault);
  EXPECT_THROW(cell.laser->fire(.05, .005), DriverError);
  EXPECT_NE(cell.robot->status().fault.find("is on longer than its pulse"), std::string::npos)
      << cell.robot->status().fault;
  cell.wire.act([](TrueCell& truth) { EXPECT_FALSE(truth.is_gate_open()); });
  ASSERT_EQ(cell.emissions().size(), 1u);
  // Without it, an answer would be waited for ten seconds of this cell.
  EXPECT_LT(cell.emissions()[0].length_s, 5);
}

TEST_F(WiredRobot, OffEndsAPulseAndWhatIsQueuedOfIt) {
  cell.laser->enable();
  cell.robot->move_to(beside(.01), .02);
  ASSERT_TRUE(cell.wait_for([&] { return cell.robot->status().in_position; }));
  Gate& gate = cell.robot->gate(1);
  gate.pulse(5);  // half a second of wall
  ASSERT_TRUE(cell.wait_for([&] {
    bool is_lit = false;
    cell.wire.act([&](TrueCell& truth) { is_lit = truth.is_emitting(); });
    return is_lit;
  }));
  EXPECT_TRUE(gate.off());
  EXPECT_FALSE(gate.is_on());
  cell.wire.act([](TrueCell& truth) { EXPECT_FALSE(truth.is_gate_open()); });
  ASSERT_EQ(cell.emissions().size(), 1u);
  EXPECT_LT(cell.emissions()[0].length_s, 4);
  cell.clock.sleep_until(cell.clock.now_s() + 1);
  EXPECT_EQ(cell.emissions().size(), 1u);
}

TEST_F(WiredRobot, AnAlarmInAPulseEndsIt) {
  cell.laser->enable();
  cell.robot->move_to(beside(.01), .02);
  ASSERT_TRUE(cell.wait_for([&] { return cell.robot->status().in_position; }));
  cell.laser->fire(.05, .05);
  order(WireFaultKind::kDeviceAlarm);
  ASSERT_TRUE(cell.wait_for([&] { return cell.robot->status().state == DeviceState::kFault; }));
  EXPECT_TRUE(cell.wait_for([&] {
    bool is_dark = false;
    cell.wire.act([&](TrueCell& truth) { is_dark = !truth.is_emitting(); });
    return is_dark;
  }));
}

TEST_F(WiredRobot, AnOpenInterlockIsKnownBeforeThePulseCounts) {
  cell.laser->enable();
  cell.robot->move_to(beside(.01), .02);
  ASSERT_TRUE(cell.wait_for([&] { return cell.robot->status().in_position; }));
  cell.laser->fire(.05, .05);
  cell.wire.act([](TrueCell& truth) { truth.set_interlock(false); });
  ASSERT_TRUE(cell.wait_for([&] { return !cell.laser->status().is_emitting; }));
  EXPECT_EQ(cell.laser->status().state, DeviceState::kFault);
  EXPECT_EQ(cell.laser->status().fault, "the interlock was opened");
  EXPECT_THROW(cell.laser->clear_fault(), DriverError) << "while it is open";
  cell.wire.act([](TrueCell& truth) { truth.set_interlock(true); });
  EXPECT_EQ(cell.laser->status().state, DeviceState::kFault) << "closing it brings nothing back";
  cell.laser->clear_fault();
  cell.laser->enable();
  EXPECT_EQ(cell.laser->status().state, DeviceState::kReady);
}

}  // namespace
}  // namespace hilbrush::test
