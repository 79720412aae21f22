#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numbers>

#include "tests/sim/wire/wire_world.h"

namespace hilbrush {
namespace {

using test::Conversation;
using test::WireWorld;

template <class Value>
Value value_at(const std::string& frame, std::size_t offset) {
  Value value;
  std::memcpy(&value, frame.data() + offset, sizeof value);
  return value;
}

class DobotTest : public testing::Test {
 protected:
  void SetUp() override {
    EXPECT_EQ(board("EnableRobot()"), "0,{},EnableRobot();");
    EXPECT_EQ(board("RobotMode()"), "0,{4},RobotMode();");
    world.pass(.3);
    EXPECT_EQ(board("RobotMode()"), "0,{5},RobotMode();");
    world.devices.cell().set_modulation(TrueCell::Modulation::kWired);
    world.devices.cell().set_power(.02);
    world.devices.cell().set_emission(true);
  }
  std::string board(const std::string& text) { return world.ask(*dashboard, text); }
  std::string move(const std::string& text) { return world.ask(*motion, text); }
  std::string frame() {
    world.pass(.008);
    return world.hear(*feedback);
  }

  WireWorld world;
  std::unique_ptr<WireSession> dashboard = world.converse(Conversation::kDashboard);
  std::unique_ptr<WireSession> motion = world.converse(Conversation::kMotion);
  std::unique_ptr<WireSession> feedback = world.converse(Conversation::kFeedback);
};

TEST_F(DobotTest, AnswersByTheErrorTable) {
  EXPECT_EQ(board("getpose()").substr(0, 3), "0,{");
  EXPECT_EQ(board("Nonsense(1)"), "-10000,{},Nonsense(1);");
  EXPECT_EQ(board("no parenthesis\n"), "-10000,{},no parenthesis;");
  EXPECT_EQ(board("SpeedFactor()"), "-20000,{},SpeedFactor();");
  EXPECT_EQ(board("SpeedFactor(fast)"), "-30001,{},SpeedFactor(fast);");
  EXPECT_EQ(board("SpeedFactor(101)"), "-40001,{},SpeedFactor(101);");
  EXPECT_EQ(move("JointMovJ(1,2,3)"), "-20000,{},JointMovJ(1,2,3);");
  EXPECT_EQ(move("JointMovJ(1,2,x,4)"), "-30003,{},JointMovJ(1,2,x,4);");
  EXPECT_EQ(move("JointMovJ(1,151,100,4)"), "-40002,{},JointMovJ(1,151,100,4);");
  EXPECT_EQ(move("JointMovJ(nan,2,100,4)"), "-30001,{},JointMovJ(nan,2,100,4);");
  EXPECT_EQ(move("wait(1.5)"), "-30001,{},wait(1.5);");
  EXPECT_EQ(move("DO(25,1)"), "-40001,{},DO(25,1);");
  EXPECT_EQ(move("DO(1,2)"), "-40002,{},DO(1,2);");
}

TEST_F(DobotTest, CommandsMayComeInPiecesOrTogether) {
  EXPECT_EQ(board("Robot"), "");
  EXPECT_EQ(board("Mode"), "");
  EXPECT_EQ(board("()\r\nRobotMode();GetErrorID()"),
            "0,{5},RobotMode();0,{5},RobotMode();0,{[[],[],[],[],[]]},GetErrorID();");
}

TEST_F(DobotTest, AcceptedIsNotDone) {
  EXPECT_EQ(move("JointMovJ(10,20,150,5)Sync()"), "0,{},JointMovJ(10,20,150,5);");
  EXPECT_EQ(board("RobotMode()"), "0,{7},RobotMode();");
  std::string frame_on_the_way = frame();
  ASSERT_EQ(frame_on_the_way.size(), 1440u);
  EXPECT_EQ(value_at<std::uint16_t>(frame_on_the_way, 0), 1440);
  EXPECT_EQ(value_at<std::uint64_t>(frame_on_the_way, 24), 7u);
  EXPECT_EQ(value_at<std::uint64_t>(frame_on_the_way, 48), 0x0123456789ABCDEFu);
  EXPECT_NEAR(value_at<double>(frame_on_the_way, 192), 10, 1e-9);
  EXPECT_GT(value_at<double>(frame_on_the_way, 432), 10.1);
  EXPECT_EQ(world.hear(*motion), "");
  world.pass(2);
  EXPECT_EQ(world.hear(*motion), "0,{},Sync();");
  const std::string at_rest = frame();
  EXPECT_EQ(value_at<std::uint64_t>(at_rest, 24), 5u);
  EXPECT_NEAR(value_at<double>(at_rest, 432), 10, 1e-9);
  EXPECT_NEAR(value_at<double>(at_rest, 432 + 16), 150, 1e-9);
  EXPECT_EQ(board("GetAngle()"), "0,{10.000000,20.000000,150.000000,5.000000},GetAngle();");
}

TEST_F(DobotTest, FramesComeEveryEightMilliseconds) {
  world.hear(*feedback);
  int frames = 0;
  for (int i = 0; i < 1000; ++i) {
    world.pass(.001);
    frames += static_cast<int>(world.hear(*feedback).size() / 1440);
  }
  EXPECT_NEAR(frames, 125, 1);
}

TEST_F(DobotTest, OnWaitOffIsAPulseThatTheControllerTimesItself) {
  EXPECT_EQ(move("DO(1,1)wait(5)DO(1,0)Sync()"), "0,{},DO(1,1);0,{},wait(5);0,{},DO(1,0);");
  EXPECT_EQ(value_at<std::uint64_t>(frame(), 16) & 1, 0u) << "over within the first frame";
  world.pass(10);  // the client has disconnected
  ASSERT_EQ(world.emissions.size(), 1u);
  EXPECT_EQ(world.emissions[0].length_s, .005);
  EXPECT_EQ(world.emissions[0].commanded_s, .005);
  EXPECT_EQ(world.emissions[0].power_w, .02);
  EXPECT_FALSE(world.emissions[0].is_moving);
}

TEST_F(DobotTest, APulseWaitsForTheMotionBeforeIt) {
  move("JointMovJ(20,20,150,5)DO(1,1)wait(10)DO(1,0)");
  const double begun_s = world.now_s();
  world.pass(3);
  ASSERT_EQ(world.emissions.size(), 1u);
  EXPECT_GT(world.emissions[0].start_s, begun_s + .01);
  EXPECT_NEAR(world.emissions[0].length_s, .01, 1e-12);
  EXPECT_TRUE(world.emissions[0].is_moving)
      << "the queue does not wait for the mechanics to settle: it is on record";
}

TEST_F(DobotTest, ClearingTheQueueLeavesOutputsAsTheyAre) {
  move("DO(1,1)wait(500)DO(1,0)");
  world.pass(.1);
  EXPECT_EQ(board("ResetRobot()"), "0,{},ResetRobot();");
  world.pass(2);
  EXPECT_TRUE(world.devices.cell().is_emitting()) << "the off that was queued is gone";
  EXPECT_EQ(board("DOExecute(1,0)"), "0,{},DOExecute(1,0);");
  ASSERT_EQ(world.emissions.size(), 1u);
  EXPECT_NEAR(world.emissions[0].length_s, 2.1, 1e-9);
}

TEST_F(DobotTest, ResetStopsShort) {
  move("JointMovJ(-40,20,150,5)JointMovJ(40,20,150,5)Sync()");
  world.pass(.05);
  board("ResetRobot()");
  EXPECT_EQ(world.hear(*motion), "-1,{},Sync();") << "what it waited for was dropped";
  world.pass(2);
  EXPECT_EQ(board("RobotMode()"), "0,{5},RobotMode();");
  EXPECT_GT(world.devices.cell().position(kJ1), 0);
}

TEST_F(DobotTest, AnAlarmNeedsClearingAndEnablingAgain) {
  move("JointMovJ(-40,20,150,5)DO(1,1)wait(5)DO(1,0)");
  world.pass(.05);
  world.devices.robot().raise_alarm(48);
  EXPECT_EQ(board("RobotMode()"), "0,{9},RobotMode();");
  EXPECT_EQ(board("GetErrorID()"), "0,{[[48],[],[],[],[]]},GetErrorID();");
  EXPECT_EQ(value_at<std::uint8_t>(frame(), 1029), 1);
  EXPECT_EQ(move("JointMovJ(0,20,150,5)"), "-1,{},JointMovJ(0,20,150,5);");
  EXPECT_EQ(board("EnableRobot()"), "-1,{},EnableRobot();");
  board("ClearError()");
  EXPECT_EQ(board("RobotMode()"), "0,{4},RobotMode();");
  board("EnableRobot()");
  world.pass(1);
  EXPECT_EQ(board("RobotMode()"), "0,{5},RobotMode();");
  EXPECT_TRUE(world.emissions.empty());
}

TEST_F(DobotTest, APoseIsReachedByTheArmsOwnGeometry) {
  auto& cell = world.devices.cell();
  move("JointMovJ(30,40,150,10)");
  world.pass(2);
  const std::string pose = board("GetPose()");
  move("JointMovJ(0,20,100,0)");
  world.pass(2);
  // small_cell() has no arm lengths: every pose is the axis itself.
  EXPECT_EQ(pose.substr(0, 3), "0,{");
  EXPECT_NEAR(cell.position(kJ1), 0, 1e-9);
}

TEST_F(DobotTest, JogsUntilToldOtherwise) {
  EXPECT_EQ(move("MoveJog(J1+)"), "0,{},MoveJog(J1+);");
  world.pass(.2);
  EXPECT_EQ(board("RobotMode()"), "0,{11},RobotMode();");
  EXPECT_EQ(move("MoveJog()"), "0,{},MoveJog();");
  const double here = world.devices.cell().position(kJ1);
  EXPECT_GT(here, .5);
  world.pass(1);
  EXPECT_NEAR(world.devices.cell().position(kJ1), here, .1);
  EXPECT_EQ(board("RobotMode()"), "0,{5},RobotMode();");
  EXPECT_EQ(move("MoveJog(J9+)"), "-30001,{},MoveJog(J9+);");
}

TEST_F(DobotTest, AStaleReportIsOfTheStateBeforeTheMove) {
  frame();
  world.devices.faults().add({.kind = WireFaultKind::kStaleInPosition,
                              .device = WireDevice::kRobot,
                              .trigger = {},
                              .messages = 1,
                              .duration_s = .1});
  move("JointMovJ(10,20,150,5)");
  const std::string stale = frame();
  EXPECT_EQ(value_at<std::uint64_t>(stale, 24), 5u);
  EXPECT_NEAR(value_at<double>(stale, 432), .5 * 180 / std::numbers::pi, 1e-9);
  world.pass(.15);
  EXPECT_LT(value_at<double>(frame(), 432), 25);
}

}  // namespace
}  // namespace hilbrush
