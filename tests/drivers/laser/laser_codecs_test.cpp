#include <gtest/gtest.h>

#include "drivers/guard/guard_codec.h"
#include "drivers/laser/cobolt_codec.h"
#include "drivers/laser/obis_codec.h"
#include "drivers/link/line_codec.h"

namespace hilbrush {
namespace {

TEST(ObisCodec, CommandsAndAnswers) {
  EXPECT_EQ(obis::encode("SYST:COMM:HAND ON"), "SYST:COMM:HAND ON\r\n");
  EXPECT_EQ(obis::power_command(.0123), "SOUR:POW:LEV:IMM:AMPL 0.012300");
  EXPECT_EQ(obis::classify("OK"), obis::LineKind::kOk);
  EXPECT_EQ(obis::classify(" ok\r"), obis::LineKind::kOk);
  EXPECT_EQ(obis::classify("ERR-100"), obis::LineKind::kError);
  EXPECT_EQ(obis::classify("0.0123"), obis::LineKind::kValue);
  EXPECT_EQ(obis::classify(""), obis::LineKind::kValue);
  EXPECT_EQ(obis::decode_switch("ON"), true);
  EXPECT_EQ(obis::decode_switch(" off "), false);
  EXPECT_EQ(obis::decode_switch("maybe"), std::nullopt);
}

/// The words that the makers' drivers list.
TEST(ObisCodec, StatusWords) {
  const auto has = [](const char* word, std::uint32_t bit) {
    return (*obis::decode_hex_word(word) & bit) != 0;
  };
  EXPECT_TRUE(has("C8001002", obis::kEmission));  // key on, emitting
  EXPECT_FALSE(has("C8001002", obis::kInterlockOpen | obis::kKeyOut | obis::kAnyFault));
  EXPECT_TRUE(has("CC000008", obis::kInterlockOpen));  // key on, interlock open
  EXPECT_FALSE(has("CC000008", obis::kKeyOut));
  EXPECT_TRUE(has("CE000008", obis::kKeyOut));  // key out, standby
  EXPECT_TRUE(has("C8001001", obis::kAnyFault));
  EXPECT_TRUE(has("C8001100", obis::kWarmUp));
  EXPECT_EQ(obis::decode_hex_word("0x10"), 16u);
  for (const char* word : {"", "0x", "C80010021", "G", "-1", "C8 00"})
    EXPECT_EQ(obis::decode_hex_word(word), std::nullopt) << word;
  EXPECT_EQ(obis::fault_text(0x22), "diode temperature, over-current");
  EXPECT_EQ(obis::fault_text(0x2000), "");
}

TEST(CoboltCodec, CommandsAndAnswers) {
  EXPECT_EQ(cobolt::encode("l0"), "l0\r");
  EXPECT_EQ(cobolt::power_command(.0123), "LASer:PM:POWer:SETPoint 12.300");
  EXPECT_EQ(cobolt::kOpen, "!e\r");
  EXPECT_EQ(cobolt::kClose, "!d\r");
  EXPECT_TRUE(cobolt::is_ok("OK\r"));
  EXPECT_FALSE(cobolt::is_ok("Syntax error: illegal command"));
  EXPECT_EQ(cobolt::fault_text(3), "interlock");
  EXPECT_EQ(cobolt::fault_text(0), "");
}

TEST(LineCodec, NumbersAreWholeLines) {
  EXPECT_EQ(line_codec::decode_number(" 0.25\r"), .25);
  EXPECT_EQ(line_codec::decode_number("+1e-3"), 1e-3);
  for (const char* line : {"", "1 2", "0,25", "nan", "inf", "0x10", "1e999", "25.0C"})
    EXPECT_EQ(line_codec::decode_number(line), std::nullopt) << line;
  EXPECT_EQ(line_codec::decode_integer("7"), 7);
  EXPECT_EQ(line_codec::decode_integer("7.5"), std::nullopt);
}

TEST(GuardCodec, MessagesComeBackAsTheyWere) {
  const auto request = guard::decode_request(guard::encode(guard::Request{17, guard::Verb::kPower, .0123}));
  ASSERT_TRUE(request);
  EXPECT_EQ(request->number, 17u);
  EXPECT_EQ(request->verb, guard::Verb::kPower);
  EXPECT_EQ(request->value, .0123);
  EXPECT_TRUE(guard::decode_request("3 disarm"));

  const auto reply = guard::decode_reply(guard::encode(guard::Reply{5, false, "the laser is out"}));
  ASSERT_TRUE(reply);
  EXPECT_FALSE(reply->is_ok);
  EXPECT_EQ(reply->text, "the laser is out");

  guard::StatusMessage message;
  message.status = {DeviceState::kFault, true, "the interlock was opened", 0};
  message.read_ns = 1234567890123;
  message.is_gate_on = true;
  message.requested_readings = 9;
  const auto status = guard::decode_status(guard::encode(message));
  ASSERT_TRUE(status);
  EXPECT_EQ(status->status.state, DeviceState::kFault);
  EXPECT_TRUE(status->status.interlock_closed);
  EXPECT_EQ(status->status.fault, "the interlock was opened");
  EXPECT_EQ(status->read_ns, 1234567890123);
  EXPECT_TRUE(status->is_gate_on);
  EXPECT_EQ(status->requested_readings, 9u);
}

TEST(GuardCodec, AnythingElseIsNoMessage) {
  for (const char* text :
       {"", "beat", "arm", "1", "1 ", "1 fly", "1 arm now", "1 power", "1 power much", "1 power nan",
        "1 power inf", "-1 arm", "99999999999 arm", "1  arm", "1 pulse .5 "})
    EXPECT_FALSE(guard::decode_request(text)) << text;
  for (const char* text :
       {"", "status", "status 1", "status 9 1 0 0 0 x", "status 1 2 0 0 0 ", "status -1 1 0 0 0 "})
    EXPECT_FALSE(guard::decode_status(text)) << text;
  for (const char* text : {"", "ok", "1 maybe", "x ok"}) EXPECT_FALSE(guard::decode_reply(text)) << text;
  EXPECT_FALSE(guard::decode_request(std::string(guard::kMessageMax + 1, '1')));
}

}  // namespace
}  // namespace hilbrush
