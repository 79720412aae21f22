#include "drivers/dobot/dobot_robot.h"

#include <gtest/gtest.h>

#include <string>
#include <thread>
#include <vector>

#include "drivers/steady_clock.h"
#include "tests/drivers/dobot/dobot_peer.h"

/// What the robot's driver makes of given frames, one by one: when a move is over, and when a pulse is.
namespace hilbrush::test {
namespace {

constexpr std::uint64_t kFrameMs = 8;
constexpr double kSettleS = .012;
constexpr int kOutput = 1;

DobotOptions options_of(const DobotPeer& peer) {
  DobotOptions options;
  options.host = "127.0.0.1";
  options.dashboard_port = peer.dashboard_port();
  options.motion_port = peer.motion_port();
  options.feedback_port = peer.feedback_port();
  options.bounds.fill({-3, 3, 1, 10});
  return options;
}

class DobotFrames : public testing::Test {
 protected:
  DobotFrames() {
    frame.mode = dobot::Mode::kEnabled;
    frame.is_enabled = true;
    std::thread connecting([this] { robot.connect(); });
    while (robot.status().read_s <= 0) play();
    connecting.join();
    robot.enable();
    robot.home();
    go(.25);
    arrive();
  }

  /// The next frame, taken in.
  void play(bool is_running = false) {
    const double last_s = robot.status().read_s;
    frame.is_running = is_running;
    frame.mode = is_running ? dobot::Mode::kRunning : dobot::Mode::kEnabled;
    frame.time_ms += kFrameMs;
    peer.show(frame);
    while (robot.status().read_s <= last_s && robot.status().state != DeviceState::kFault)
      std::this_thread::yield();
  }
  bool is_in_position() { return robot.status().in_position; }

  /// J1 of all that the frames tell; the wire's unit is ours here.
  void stand_at(double place) { frame.setpoint[0] = frame.actual[0] = place; }
  void go(double place) {
    robot.move_to({place, 0, 0, 0}, kSettleS);
    stand_at(place);
  }
  void arrive() {
    for (int i = 0; i < 3; ++i) play();
    ASSERT_TRUE(is_in_position());
  }
  void pulse() {
    gate.pulse(.005);
    frame.digital_outputs = 1 << (kOutput - 1);
    play(true);
    frame.digital_outputs = 0;
  }
  void finish_pulse() {
    peer.finish_pulse();
    while (gate.is_on()) std::this_thread::yield();
  }

  DobotPeer peer;
  SteadyClock clock{50};  // slow: nothing here may wait for time to pass, nor be late on a busy machine
  DobotRobot robot{options_of(peer), clock};
  Gate& gate = robot.gate(kOutput);
  dobot::Frame frame;
};

TEST_F(DobotFrames, SettlingIsCountedFromTheFirstThatShowsRest) {
  go(.5);
  frame.speed[0] = 20;
  play(true);
  frame.speed[0] = 0;
  play();  // at rest since 0 to 8 ms
  EXPECT_FALSE(is_in_position());
  play();
  EXPECT_FALSE(is_in_position()) << "after 8 ms of 12";
  play();
  EXPECT_TRUE(is_in_position());
}

/// A move shorter than a frame: its set-point is there, nothing turns yet that a frame could tell, and it has
/// begun.
TEST_F(DobotFrames, OneThatRunsIsNotAtRestThoughAPulseHasJustEnded) {
  pulse();
  finish_pulse();
  go(.25001);
  play(true);
  play();
  EXPECT_FALSE(is_in_position());
  play();
  EXPECT_FALSE(is_in_position()) << "the frame that ran was taken for rest";
  play();
  EXPECT_TRUE(is_in_position());
}

TEST_F(DobotFrames, OneThatRunsIsAtRestWhileTheQueueTimesAPulseInPlace) {
  pulse();
  EXPECT_TRUE(is_in_position());
  play(true);
  EXPECT_TRUE(is_in_position());
  finish_pulse();
  play(true);
  EXPECT_TRUE(is_in_position()) << "a frame from before the end of the pulse";
  play();
  EXPECT_TRUE(is_in_position());
}

TEST_F(DobotFrames, LeavingThePlaceDuringAPulseIsSeen) {
  pulse();
  frame.actual[0] += .01;
  play(true);
  EXPECT_FALSE(is_in_position());
  frame.actual[0] = frame.setpoint[0];
  play(true);
  EXPECT_FALSE(is_in_position()) << "settling starts again";
  finish_pulse();
  arrive();
}

TEST_F(DobotFrames, AStampThatIsRepeatedTellsNothing) {
  go(.5);
  play();
  EXPECT_FALSE(is_in_position());
  for (int i = 0; i < 20; ++i) peer.show(frame);
  play();
  EXPECT_FALSE(is_in_position());
  play();
  EXPECT_TRUE(is_in_position());
}

TEST_F(DobotFrames, AnOutputOnLongerThanItsPulseIsAFaultAndOrderedOff) {
  gate.pulse(.005);
  peer.take_orders();
  frame.digital_outputs = 1 << (kOutput - 1);
  for (int i = 0; i < 3; ++i) play(true);  // 16 ms after the first
  EXPECT_EQ(robot.status().state, DeviceState::kReady);
  play(true);
  EXPECT_EQ(robot.status().state, DeviceState::kFault);
  EXPECT_EQ(robot.status().fault, "the robot's output 1 is on longer than its pulse");
  std::vector<std::string> orders;
  while (orders.size() < 3)
    for (const std::string& order : peer.take_orders()) orders.push_back(order);
  EXPECT_EQ(orders, (std::vector<std::string>{"DOExecute(1,0)", "ResetRobot()", "DOExecute(1,0)"}));
}

TEST_F(DobotFrames, AnOutputThatNobodyOrderedIsAFault) {
  pulse();
  finish_pulse();
  for (int i = 0; i < 4; ++i) play();  // the frames that may be older than the answer
  frame.digital_outputs = 1 << (kOutput - 1);
  play();
  EXPECT_EQ(robot.status().fault, "the robot's output 1 is on without an order");
}

}  // namespace
}  // namespace hilbrush::test
