#include "drivers/dobot/dobot_codec.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "tests/drivers/dobot/dobot_peer.h"

/// Pinned to the words of the manual "TCP_IP Remote Control Interface Guide (4axis)".
namespace hilbrush {
namespace {

TEST(DobotCodec, CommandsAreWrittenAsInTheManual) {
  EXPECT_EQ(dobot::encode("EnableRobot"), "EnableRobot()");
  EXPECT_EQ(dobot::encode("SpeedFactor", {80}), "SpeedFactor(80)");
  EXPECT_EQ(dobot::encode("DOExecute", {1, 0}), "DOExecute(1,0)");
  EXPECT_EQ(dobot::encode_joint_move({1.5, -90, 123.4567891, 0}),
            "JointMovJ(1.500000,-90.000000,123.456789,0.000000)");
  const auto pulse = dobot::encode_pulse(2, 5);
  EXPECT_EQ(pulse[0] + pulse[1] + pulse[2] + pulse[3], "DO(2,1)wait(5)DO(2,0)Sync()");
}

TEST(DobotCodec, RepliesAreTakenApart) {
  auto reply = dobot::decode_reply("0,{5},RobotMode()");
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->error, 0);
  EXPECT_EQ(reply->values, "5");
  EXPECT_EQ(reply->command, "RobotMode()");

  reply = dobot::decode_reply("-40001,{},DOExecute(99,0)");
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->error, -40001);
  EXPECT_NE(dobot::error_text(reply->error).find("parameter 1 is out of range"), std::string::npos);
  EXPECT_NE(dobot::error_text(-30002).find("parameter 2 is of a wrong type"), std::string::npos);
  EXPECT_NE(dobot::error_text(-10000).find("unknown"), std::string::npos);
  EXPECT_NE(dobot::error_text(-20000).find("number of parameters"), std::string::npos);

  reply = dobot::decode_reply("\n0,{[[17],[],[],[]]},GetErrorID() ");
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->values, "[[17],[],[],[]]");
}

TEST(DobotCodec, WhatIsNoReplyIsRefused) {
  for (const char* text :
       {"", "0", "0,", "0,{}", "0,{},", "0,{},RobotMode", ",{},RobotMode()", "0,{,RobotMode()",
        "0;{};RobotMode()", "ok", "0,}{,RobotMode()", "99999999999999999999999,{},A()", "0,{},()"})
    EXPECT_FALSE(dobot::decode_reply(text)) << text;
}

TEST(DobotCodec, AnEchoIsRecognizedWithoutRegardToCase) {
  EXPECT_TRUE(dobot::is_echo("jointmovj(1.0,2,3,4)", "JointMovJ(1.000000,2.000000,3.000000,4.000000)"));
  EXPECT_TRUE(dobot::is_echo("Sync()", "Sync()"));
  EXPECT_FALSE(dobot::is_echo("DO(1,0)", "Sync()"));
  EXPECT_FALSE(dobot::is_echo("DO(1)", "DO(1,0)"));
  EXPECT_FALSE(dobot::is_echo("SpeedFactor()", "SpeedFactor(5)"));
  EXPECT_FALSE(dobot::is_echo("", "Sync()"));
}

std::string packet(std::uint64_t time_ms, double first_joint = 12.5) {
  dobot::Frame frame;
  frame.digital_outputs = 0b101;
  frame.mode = dobot::Mode::kEnabled;
  frame.time_ms = time_ms;
  frame.setpoint[0] = first_joint;
  frame.actual[0] = first_joint + 1;
  frame.speed[0] = -3.25;
  frame.is_enabled = frame.has_error = true;
  return test::dobot_packet(frame);
}

TEST(DobotCodec, FramesAreReadAtTheirOffsets) {
  const auto frame = dobot::decode_frame(packet(4711));
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->digital_outputs, 0b101u);
  EXPECT_EQ(frame->mode, dobot::Mode::kEnabled);
  EXPECT_EQ(frame->time_ms, 4711u);
  EXPECT_EQ(frame->setpoint[0], 12.5);
  EXPECT_EQ(frame->actual[0], 13.5);
  EXPECT_EQ(frame->speed[0], -3.25);
  EXPECT_TRUE(frame->is_enabled);
  EXPECT_FALSE(frame->is_running);
  EXPECT_TRUE(frame->has_error);
}

TEST(DobotCodec, FramesWithNonsenseInThemAreNone) {
  EXPECT_FALSE(dobot::decode_frame(packet(1).substr(1)));
  EXPECT_FALSE(dobot::decode_frame(packet(1) + "x"));
  EXPECT_FALSE(dobot::decode_frame(packet(1, std::numeric_limits<double>::quiet_NaN())));
  EXPECT_FALSE(dobot::decode_frame(packet(1, std::numeric_limits<double>::infinity())));
  EXPECT_FALSE(dobot::decode_frame(packet(1, 1e300)));
  std::string bytes = packet(1);
  bytes[48] ^= 1;
  EXPECT_FALSE(dobot::decode_frame(bytes));
}

TEST(DobotCodec, AStreamFindsItsPlaceAgain) {
  dobot::FrameStream stream;
  const std::string half = packet(2).substr(0, 700);
  stream.push("rubbish" + packet(1) + half + packet(3));
  std::string rest = packet(4);
  ASSERT_TRUE(stream.next());
  const auto third = stream.next();
  ASSERT_TRUE(third);
  EXPECT_EQ(third->time_ms, 3u);  // the half one is lost, and nothing else
  EXPECT_FALSE(stream.next());
  EXPECT_EQ(stream.dropped_bytes(), 7u + 700u);
  for (const char byte : rest) {
    EXPECT_FALSE(stream.next());
    stream.push({&byte, 1});
  }
  const auto fourth = stream.next();
  ASSERT_TRUE(fourth);
  EXPECT_EQ(fourth->time_ms, 4u);
}

TEST(DobotCodec, ReplyStreamsAreCutAtTheirSemicolons) {
  dobot::ReplyStream stream;
  stream.push("0,{},DO(1,1);0,{},wa");
  EXPECT_EQ(stream.next(), "0,{},DO(1,1)");
  EXPECT_EQ(stream.next(), std::nullopt);
  stream.push("it(5);");
  EXPECT_EQ(stream.next(), "0,{},wait(5)");
  EXPECT_TRUE(stream.is_empty());
  stream.push(std::string(dobot::ReplyStream::kReplyMax + 1, 'x'));
  EXPECT_TRUE(stream.is_overlong());
}

}  // namespace
}  // namespace hilbrush
