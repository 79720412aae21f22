#include <gtest/gtest.h>

#include "tests/sim/wire/wire_world.h"

namespace hilbrush {
namespace {

using test::Conversation;
using test::WireWorld;

WireOptions with_laser(WireOptions::LaserHead head, double start_delay_s = 0, double warm_up_s = 0) {
  WireOptions options = WireWorld::quick();
  options.laser = head;
  options.start_delay_s = start_delay_s;
  options.warm_up_s = warm_up_s;
  return options;
}

/// A laser that is spoken to in lines.
class LaserHeadTest : public testing::Test {
 protected:
  LaserHeadTest(const WireOptions& options, const char* line_end) : world(options), line_end_(line_end) {}
  std::string ask(const std::string& line) { return world.ask(*session, line + line_end_); }
  WireWorld world;
  std::unique_ptr<WireSession> session = world.converse(Conversation::kLaser);
  TrueCell& cell = world.devices.cell();

 private:
  const char* line_end_;
};

class ObisTest : public LaserHeadTest {
 protected:
  ObisTest() : LaserHeadTest(with_laser(WireOptions::LaserHead::kObis, 5), "\r\n") {}
};

TEST_F(ObisTest, AnswersQueriesWithValueAndOk) {
  EXPECT_EQ(ask("SYST:INF:MOD?"), "OBIS 405nm 100mW C\r\nOK\r\n");
  EXPECT_EQ(ask("sour:pow:lim:low?"), "0.001000\r\nOK\r\n");
  EXPECT_EQ(ask("SOUR:POW:LIM:HIGH?"), "0.200000\r\nOK\r\n");
  EXPECT_EQ(ask("SYST:LOCK?"), "ON\r\nOK\r\n");
  EXPECT_EQ(ask("SYST:STAT?"), "C8000008\r\nOK\r\n");
  EXPECT_EQ(ask(""), "");
  EXPECT_EQ(ask("SYST:NONE?"), "ERR-100\r\n");
  EXPECT_EQ(ask("SYST:ERR:COUN?"), "1\r\nOK\r\n");
  EXPECT_EQ(ask("SYST:ERR:CLE"), "OK\r\n");
  EXPECT_EQ(ask("SYST:ERR:COUN?"), "0\r\nOK\r\n");
}

TEST_F(ObisTest, WithoutHandshakeCommandsAreMute) {
  EXPECT_EQ(ask("SYST:COMM:HAND OFF"), "");
  EXPECT_EQ(ask("SYST:CDRH ON"), "");
  EXPECT_EQ(ask("SYST:CDRH?"), "ON\r\n");
  EXPECT_EQ(ask("NONSENSE"), "");
  EXPECT_EQ(ask("SYST:COMM:HAND ON"), "OK\r\n");
}

TEST_F(ObisTest, LightNeedsEmissionDelayAndGate) {
  EXPECT_EQ(ask("SOUR:AM:EXT DIGITAL"), "OK\r\n");
  EXPECT_EQ(ask("SOUR:AM:SOUR?"), "DIGITAL\r\nOK\r\n");
  EXPECT_EQ(ask("SOUR:POW:LEV:IMM:AMPL 0.05"), "OK\r\n");
  EXPECT_EQ(ask("SOUR:POW:LEV:IMM:AMPL 0.3"), "ERR-222\r\n");
  EXPECT_EQ(ask("SOUR:POW:LEV:IMM:AMPL 0.0001"), "ERR-222\r\n");
  EXPECT_EQ(ask("SOUR:POW:LEV:IMM:AMPL much"), "ERR-222\r\n");
  EXPECT_EQ(ask("SOUR:POW:LEV:IMM:AMPL?"), "0.050000\r\nOK\r\n");
  EXPECT_EQ(ask("SOUR:AM:STAT ON"), "OK\r\n");
  EXPECT_EQ(ask("SYST:STAT?"), "C8000410\r\nOK\r\n") << "in its start delay";
  cell.set_gate(true);
  world.pass(1);
  EXPECT_FALSE(cell.is_emitting());
  cell.set_gate(false);
  world.pass(4.5);
  EXPECT_EQ(ask("SYST:STAT?"), "C8000406\r\nOK\r\n");
  cell.set_gate(true);
  EXPECT_TRUE(cell.is_emitting());
  EXPECT_EQ(ask("SOUR:POW:LEV?"), "0.050000\r\nOK\r\n");
  EXPECT_EQ(ask("SOUR:AM:STAT OFF"), "OK\r\n");
  EXPECT_FALSE(cell.is_emitting());
  ASSERT_EQ(world.emissions.size(), 1u);
  EXPECT_EQ(world.emissions[0].power_w, .05);
}

TEST_F(ObisTest, SaysWhatHoldsItBack) {
  cell.set_interlock(false);
  EXPECT_EQ(ask("SYST:STAT?"), "CC000008\r\nOK\r\n");
  EXPECT_EQ(ask("SYST:LOCK?"), "OFF\r\nOK\r\n");
  EXPECT_EQ(ask("SOUR:AM:STAT ON"), "ERR-222\r\n");
  cell.set_interlock(true);
  cell.set_key(false);
  EXPECT_EQ(ask("SYST:STAT?"), "CE000008\r\nOK\r\n");
  EXPECT_EQ(ask("SOUR:AM:STAT ON"), "ERR-222\r\n");
  cell.set_key(true);
  EXPECT_EQ(ask("SOUR:AM:STAT ON"), "OK\r\n");
  cell.set_interlock(false);
  cell.set_interlock(true);
  EXPECT_EQ(ask("SYST:STAT?"), "C8000009\r\nOK\r\n") << "the interlock was open: latched";
  EXPECT_EQ(ask("SOUR:AM:STAT?"), "OFF\r\nOK\r\n");
}

TEST(ObisWarmUpTest, TakesTime) {
  WireWorld world(with_laser(WireOptions::LaserHead::kObis, 0, 60));
  const auto session = world.converse(Conversation::kLaser);
  world.ask(*session, "SOUR:AM:STAT ON\r");
  EXPECT_EQ(world.ask(*session, "SYST:STAT?\r"), "C8000100\r\nOK\r\n");
  world.pass(59);
  EXPECT_FALSE(world.devices.cell().is_emitting());
  world.pass(2);
  EXPECT_TRUE(world.devices.cell().is_emitting());
}

class CoboltTest : public LaserHeadTest {
 protected:
  CoboltTest() : LaserHeadTest(with_laser(WireOptions::LaserHead::kCobolt), "\r") {}
};

TEST_F(CoboltTest, ModulatesBySerialCommandsWithoutAnswers) {
  EXPECT_EQ(ask("gom?"), "0\r\n");
  EXPECT_EQ(ask("LAS:RUNM PowerModulation"), "OK\r\n");
  EXPECT_EQ(ask("laser:pm:dig:modulator Command"), "OK\r\n");
  EXPECT_EQ(ask("l1"), "OK\r\n");
  EXPECT_EQ(ask("gom?"), "7\r\n");
  EXPECT_EQ(ask("!p 12.50"), "");
  EXPECT_FALSE(cell.is_emitting());
  cell.set_gate(true);
  EXPECT_FALSE(cell.is_emitting()) << "the wired input does not count";
  EXPECT_EQ(ask("!e"), "");
  EXPECT_TRUE(cell.is_emitting());
  world.pass(.004);
  EXPECT_EQ(ask("!d"), "");
  ASSERT_EQ(world.emissions.size(), 1u);
  EXPECT_NEAR(world.emissions[0].length_s, .004, 1e-12);
  EXPECT_NEAR(world.emissions[0].power_w, .0125, 1e-12);
  EXPECT_EQ(ask("las:paus 1"), "OK\r\n");
  ask("!e");
  EXPECT_FALSE(cell.is_emitting());
}

TEST_F(CoboltTest, TellsInterlockAndFault) {
  EXPECT_EQ(ask("ilk?"), "0\r\n");
  cell.set_interlock(false);
  EXPECT_EQ(ask("ilk?"), "1\r\n");
  EXPECT_EQ(ask("f?"), "3\r\n");
  EXPECT_EQ(ask("l1"), "Syntax error: illegal command\r\n");
  EXPECT_EQ(ask("cf"), "Syntax error: illegal command\r\n");
  cell.set_interlock(true);
  EXPECT_EQ(ask("cf"), "OK\r\n");
  EXPECT_EQ(ask("f?"), "0\r\n");
  EXPECT_EQ(ask("rubbish"), "Syntax error: illegal command\r\n");
  EXPECT_EQ(ask("p 5"), "Syntax error: illegal command\r\n") << "5 W is beyond it";
}

}  // namespace
}  // namespace hilbrush
