#include <fmt/format.h>
#include <gtest/gtest.h>

#include <random>

#include "sampling/base/angles.h"
#include "tests/sim/wire/wire_world.h"

namespace hilbrush {
namespace {

using test::Conversation;
using test::from_hex;
using test::to_hex;
using test::WireWorld;
using test::with_crc;

/// Without the checksum, or "bad" if it does not fit.
std::string body(const std::string& frame) {
  if (frame.empty()) return "";
  return modbus_crc(frame) == 0 ? to_hex(frame.substr(0, frame.size() - 2)) : "bad";
}

TEST(ModbusServerTest, KnowsTheChecksumOfTheSerialLineGuide) {
  EXPECT_EQ(modbus_crc(from_hex("02 07")), 0x1241);
  EXPECT_EQ(modbus_crc(from_hex("01 03 00 00 00 0A C5 CD")), 0);
}

class OrientalTest : public testing::Test {
 protected:
  std::string rtu(const std::string& hex) { return body(world.ask(*line, with_crc(hex))); }
  /// The write of 16 registers that starts a move: 10 degrees in steps, 20,000 steps/s, 100,000 steps/s2.
  static constexpr const char* kMove =
      "01 10 00 58 00 10 20 00 00 00 00 00 00 00 01 00 01 86 A0 00 00 4E 20 00 01 86 A0 00 01 86 A0 00 00 03 "
      "E8 "
      "00 00 00 01";
  WireWorld world;
  std::unique_ptr<WireSession> line = world.converse(Conversation::kTableRtu);
  std::unique_ptr<WireSession> socket = world.converse(Conversation::kTableTcp);
};

TEST_F(OrientalTest, TheWriteItselfStartsTheMove) {
  EXPECT_EQ(rtu("01 03 00 7F 00 01"), "01 03 02 40 30") << "READY, IN-POS, HOME-END";
  EXPECT_EQ(rtu(kMove), "01 10 00 58 00 10");
  EXPECT_EQ(rtu("01 03 00 7F 00 01"), "01 03 02 20 10") << "MOVE";
  world.pass(.1);
  EXPECT_GT(world.devices.cell().position(kTilt), 0);
  world.pass(20);
  EXPECT_EQ(rtu("01 03 00 7F 00 01"), "01 03 02 40 30");
  EXPECT_EQ(rtu("01 03 01 20 00 04"), "01 03 08 00 01 86 A0 00 01 86 A0") << "feedback and command position";
  EXPECT_NEAR(world.devices.cell().position(kTilt), 10 * kDegree, 1e-12);
  EXPECT_EQ(world.devices.cell().position(kRotation), 0);
}

TEST_F(OrientalTest, InPositionComesOnlyWhenItHasSettled) {
  rtu(kMove);
  world.devices.advance(world.devices.cell().rest_s(kTilt) + .001);
  EXPECT_EQ(rtu("01 03 00 7F 00 01"), "01 03 02 00 30") << "at rest: neither MOVE nor IN-POS";
  world.devices.advance(world.devices.cell().settled_s(kTilt));
  EXPECT_EQ(rtu("01 03 00 7F 00 01"), "01 03 02 40 30");
}

TEST_F(OrientalTest, StopsOnTheRisingEdgeOfItsInput) {
  rtu(kMove);
  world.pass(.5);
  EXPECT_EQ(rtu("01 06 00 7D 00 20"), "01 06 00 7D 00 20");
  world.pass(1);
  const double here = world.devices.cell().position(kTilt);
  EXPECT_LT(here, 9 * kDegree);
  rtu("01 06 00 7D 00 00");
  world.pass(1);
  EXPECT_EQ(world.devices.cell().position(kTilt), here);
}

TEST_F(OrientalTest, AnAlarmForbidsMovesUntilItIsReset) {
  world.devices.table_axis(0).raise_alarm(0x30);
  EXPECT_EQ(rtu("01 03 00 7F 00 01"), "01 03 02 40 90");
  EXPECT_EQ(rtu("01 03 00 80 00 02"), "01 03 04 00 00 00 30");
  EXPECT_EQ(rtu(kMove), "01 90 04");
  rtu("01 06 00 7D 00 80");
  rtu("01 06 00 7D 00 00");
  EXPECT_EQ(rtu(kMove), "01 10 00 58 00 10");
}

TEST_F(OrientalTest, RefusesWhatIsOutsideItsTables) {
  EXPECT_EQ(rtu("01 03 05 00 00 01"), "01 83 02");
  EXPECT_EQ(rtu("01 06 05 00 00 01"), "01 86 02");
  EXPECT_EQ(rtu("01 03 00 7F 00 00"), "01 83 03");
  EXPECT_EQ(world.ask(*socket, from_hex("00 07 00 00 00 06 01 05 00 00 FF 00")),
            from_hex("00 07 00 00 00 03 01 85 01"));
  // 360 degrees of tilt.
  std::string far = kMove;
  far.replace(far.find("00 01 86 A0"), 11, "00 36 EE 80");
  EXPECT_EQ(rtu(far), "01 90 04");
  world.pass(1);
  EXPECT_EQ(world.devices.cell().position(kTilt), 0);
}

TEST_F(OrientalTest, UnitsAreTwoAndNobodyElseAnswers) {
  std::string second = kMove;
  second.replace(0, 2, "02");
  EXPECT_EQ(rtu(second), "02 10 00 58 00 10");
  world.pass(10);
  EXPECT_NEAR(world.devices.cell().position(kRotation), 10 * kDegree, 1e-12);
  EXPECT_EQ(rtu("03 03 00 7F 00 01"), "");
  EXPECT_EQ(to_hex(world.ask(*socket, from_hex("00 01 00 00 00 06 03 03 00 7F 00 01"))),
            "00 01 00 00 00 03 03 83 0B");
}

TEST_F(OrientalTest, WritesThenReadsInOneExchange) {
  EXPECT_EQ(
      to_hex(world.ask(*socket, from_hex("12 34 00 00 00 0F 01 17 00 5C 00 02 00 5C 00 02 04 00 00 00 07"))),
      "12 34 00 00 00 07 01 17 04 00 00 00 07");
}

TEST_F(OrientalTest, FramesInPiecesAndDamagedFrames) {
  const std::string whole = with_crc("01 03 00 7F 00 01");
  for (std::size_t i = 0; i + 1 < whole.size(); ++i) EXPECT_EQ(world.ask(*line, whole.substr(i, 1)), "");
  EXPECT_EQ(body(world.ask(*line, whole.substr(whole.size() - 1))), "01 03 02 40 30");
  std::string damaged = whole;
  damaged[3] = static_cast<char>(damaged[3] ^ 1);
  EXPECT_EQ(world.ask(*line, damaged), "");
  EXPECT_EQ(rtu("01 03 00 7F 00 01"), "01 03 02 40 30") << "and the next one is understood";
}

TEST_F(OrientalTest, NoiseIsAnsweredWithNothingLongAndHarmsNothing) {
  const unsigned seed = 3;
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  for (int round = 0; round < 20'000; ++round) {
    std::string noise(random() % 40, '\0');
    for (char& c : noise) c = static_cast<char>(random() % 4 == 0 ? random() : random() % 24);
    EXPECT_LE(world.ask(*line, noise).size(), 2000u);
    EXPECT_LE(world.ask(*socket, noise).size(), 2000u);
  }
  world.pass(1000);
  EXPECT_TRUE(world.devices.cell().is_settled());
}

class Cia402Test : public testing::Test {
 protected:
  static WireOptions options() {
    WireOptions options = WireWorld::quick();
    options.table = WireOptions::Table::kCia402;
    return options;
  }
  unsigned read(unsigned index) {
    const std::string request = fmt::format("01 03 {:02X} {:02X} 00 01", index >> 8, index & 0xff);
    const std::string reply = from_hex(body(world.ask(*line, with_crc(request))));
    return reply.size() == 5 ? static_cast<unsigned>(static_cast<unsigned char>(reply[3]) << 8 |
                                                     static_cast<unsigned char>(reply[4]))
                             : 0xFFFFF;
  }
  void control(unsigned word) {
    const std::string request = fmt::format("01 06 60 40 {:02X} {:02X}", word >> 8, word & 0xff);
    EXPECT_EQ(body(world.ask(*line, with_crc(request))), request);
  }
  WireWorld world{options()};
  std::unique_ptr<WireSession> line = world.converse(Conversation::kTableRtu);
};

TEST_F(Cia402Test, OneMoveByTheHandshake) {
  EXPECT_EQ(read(0x6041) & 0x6F, 0x40u) << "switch on disabled";
  control(0x0006);
  EXPECT_EQ(read(0x6041) & 0x6F, 0x21u);
  control(0x0007);
  EXPECT_EQ(read(0x6041) & 0x6F, 0x23u);
  control(0x000F);
  EXPECT_EQ(read(0x6041) & 0x6F, 0x27u);
  EXPECT_EQ(body(world.ask(*line, with_crc("01 10 60 7A 00 02 04 86 A0 00 01"))), "01 10 60 7A 00 02")
      << "low word first";
  control(0x001F);
  EXPECT_EQ(read(0x6041) & 0x1400, 0x1000u) << "acknowledged, not there";
  control(0x000F);
  EXPECT_EQ(read(0x6041) & 0x1000, 0u);
  world.pass(5);
  EXPECT_EQ(read(0x6041) & 0x0400, 0x0400u);
  EXPECT_EQ(body(world.ask(*line, with_crc("01 03 60 64 00 02"))), "01 03 04 86 A0 00 01");
  EXPECT_NEAR(world.devices.cell().position(kTilt), 10 * kDegree, 1e-12);
}

TEST_F(Cia402Test, QuickStopAndFaultReset) {
  for (const unsigned word : {0x6u, 0x7u, 0xFu}) control(word);
  world.ask(*line, with_crc("01 10 60 7A 00 02 04 86 A0 00 01"));
  control(0x1F);
  world.pass(.05);
  control(0x0B);
  world.pass(1);
  EXPECT_LT(world.devices.cell().position(kTilt), 9 * kDegree);
  EXPECT_EQ(read(0x6041) & 0x40, 0x40u);
  // A target outside the axis's limits is a fault.
  for (const unsigned word : {0x6u, 0x7u, 0xFu}) control(word);
  world.ask(*line, with_crc("01 10 60 7A 00 02 04 86 A0 7F 01"));
  control(0x1F);
  EXPECT_EQ(read(0x6041) & 0x4F, 0x08u);
  EXPECT_EQ(read(0x603F), 0x8612u);
  control(0x0F);
  EXPECT_EQ(read(0x6041) & 0x08, 0x08u);
  control(0x80);
  EXPECT_EQ(read(0x6041) & 0x4F, 0x40u);
  EXPECT_EQ(body(world.ask(*line, with_crc("01 03 60 64 00 01"))), "01 83 02") << "an object is read whole";
}

TEST(LeadshineTest, OneMoveByPathZero) {
  WireOptions options = WireWorld::quick();
  options.table = WireOptions::Table::kLeadshinePr;
  WireWorld world(options);
  const auto line = world.converse(Conversation::kTableRtu);
  const auto rtu = [&](const std::string& hex) { return body(world.ask(*line, with_crc(hex))); };
  EXPECT_EQ(rtu("02 03 10 03 00 01"), "02 03 02 00 72");
  EXPECT_EQ(rtu("02 10 62 00 00 06 0C 00 01 00 01 86 A0 02 58 00 64 00 64"), "02 10 62 00 00 06");
  EXPECT_EQ(rtu("02 06 60 02 00 10"), "02 06 60 02 00 10");
  EXPECT_EQ(rtu("02 03 10 03 00 01"), "02 03 02 00 46") << "running";
  world.pass(5);
  EXPECT_EQ(rtu("02 03 10 03 00 01"), "02 03 02 00 72");
  EXPECT_EQ(rtu("02 03 60 2C 00 02"), "02 03 04 00 01 86 A0") << "high word first";
  EXPECT_NEAR(world.devices.cell().position(kRotation), 10 * kDegree, 1e-12);
  world.devices.table_axis(1).raise_alarm(0x180);
  EXPECT_EQ(rtu("02 03 22 03 00 01"), "02 03 02 01 80");
  EXPECT_EQ(rtu("02 06 60 02 00 10"), "02 86 04");
  EXPECT_EQ(rtu("02 06 18 01 11 11"), "02 06 18 01 11 11");
  EXPECT_EQ(rtu("02 06 60 02 00 40"), "02 06 60 02 00 40");
}

}  // namespace
}  // namespace hilbrush
