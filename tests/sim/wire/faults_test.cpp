#include <gtest/gtest.h>

#include <cmath>

#include "config/fault_script_file.h"
#include "sampling/base/input_error.h"
#include "tests/sim/wire/wire_world.h"

namespace hilbrush {
namespace {

using test::Conversation;
using test::from_hex;
using test::to_hex;
using test::WireWorld;

WireFault fault_of(WireFaultKind kind, WireDevice device, double duration_s = .05) {
  WireFault fault;
  fault.kind = kind;
  fault.device = device;
  fault.duration_s = duration_s;
  return fault;
}

const char* kAskTable = "00 05 00 00 00 06 01 03 00 7F 00 01";

class ExchangeFaultTest : public testing::Test {
 protected:
  std::string robot() { return world.ask(*dashboard, "DOExecute(2,1)"); }
  std::string table() { return to_hex(world.ask(*modbus, from_hex(kAskTable))); }
  std::string laser() { return world.ask(*obis, "SOUR:AM:EXT DIGITAL\r\n"); }
  void expect_all_well() {
    EXPECT_EQ(robot(), "0,{},DOExecute(2,1);");
    EXPECT_EQ(table(), "00 05 00 00 00 05 01 03 02 40 30");
    EXPECT_EQ(laser(), "OK\r\n");
  }
  void break_all(WireFaultKind kind) {
    for (const WireDevice device : {WireDevice::kRobot, WireDevice::kTable, WireDevice::kLaser})
      world.devices.faults().add(fault_of(kind, device));
  }
  bool is_digital() { return world.devices.cell().modulation() == TrueCell::Modulation::kWired; }

  WireWorld world;
  std::unique_ptr<WireSession> dashboard = world.converse(Conversation::kDashboard);
  std::unique_ptr<WireSession> modbus = world.converse(Conversation::kTableTcp);
  std::unique_ptr<WireSession> obis = world.converse(Conversation::kLaser);
};

TEST_F(ExchangeFaultTest, LostRequestsAreNeitherObeyedNorAnswered) {
  break_all(WireFaultKind::kLostRequest);
  EXPECT_EQ(laser(), "");
  EXPECT_FALSE(is_digital());
  EXPECT_EQ(robot(), "");
  EXPECT_EQ(table(), "");
  expect_all_well();
  EXPECT_EQ(world.devices.faults().begun_count(), 3u);
}

TEST_F(ExchangeFaultTest, SilenceIsAfterTheAct) {
  break_all(WireFaultKind::kSilence);
  EXPECT_EQ(laser(), "");
  EXPECT_TRUE(is_digital());
  EXPECT_EQ(robot() + table(), "");
  expect_all_well();
}

TEST_F(ExchangeFaultTest, HalfFramesAreHalf) {
  break_all(WireFaultKind::kHalfFrame);
  EXPECT_EQ(robot(), "0,{},DOExe");
  EXPECT_EQ(table(), "00 05 00 00 00");
  EXPECT_EQ(laser(), "OK");
  expect_all_well();
}

TEST_F(ExchangeFaultTest, WrongIdsAndChecksums) {
  break_all(WireFaultKind::kWrongId);
  EXPECT_EQ(robot(), "0,{},GetTime();");
  EXPECT_EQ(table(), "00 06 00 00 00 05 01 03 02 40 30");
  EXPECT_EQ(laser(), "0.12345\r\nOK\r\n");
  break_all(WireFaultKind::kWrongChecksum);
  EXPECT_NE(robot(), "0,{},DOExecute(2,1);");
  EXPECT_NE(table(), "00 05 00 00 00 05 01 03 02 40 30");
  EXPECT_NE(laser(), "OK\r\n");
  expect_all_well();

  const auto line = world.converse(Conversation::kTableRtu);
  const std::string request = test::with_crc("01 03 00 7F 00 01");
  world.devices.faults().add(fault_of(WireFaultKind::kWrongChecksum, WireDevice::kTable));
  EXPECT_NE(modbus_crc(world.ask(*line, request)), 0);
  world.devices.faults().add(fault_of(WireFaultKind::kWrongId, WireDevice::kTable));
  const std::string other = world.ask(*line, request);
  EXPECT_EQ(modbus_crc(other), 0);
  EXPECT_EQ(other[0], 2);
}

TEST_F(ExchangeFaultTest, ExceptionsAndRefusalsAreAnsweredAndNotObeyed) {
  break_all(WireFaultKind::kException);
  EXPECT_EQ(robot(), "-1,{},DOExecute(2,1);");
  EXPECT_EQ(table(), "00 05 00 00 00 03 01 83 04");
  EXPECT_EQ(laser(), "ERR-310\r\n");
  EXPECT_FALSE(is_digital());
  break_all(WireFaultKind::kRefused);
  EXPECT_EQ(robot(), "-1,{},DOExecute(2,1);");
  EXPECT_EQ(table(), "00 05 00 00 00 03 01 83 03");
  EXPECT_EQ(laser(), "ERR-222\r\n");
  expect_all_well();
}

TEST_F(ExchangeFaultTest, LateAnswersHoldUpWhatFollows) {
  break_all(WireFaultKind::kLateAnswer);
  EXPECT_EQ(laser() + robot() + table(), "");
  EXPECT_TRUE(is_digital());
  EXPECT_NEAR(obis->next_event_s() - world.now_s(), .05, 1e-9);
  world.pass(.03);
  EXPECT_EQ(world.ask(*obis, "SYST:AUT?\r"), "");
  world.pass(.03);
  EXPECT_EQ(world.hear(*obis), "OK\r\nOFF\r\nOK\r\n");
  EXPECT_EQ(world.hear(*dashboard), "0,{},DOExecute(2,1);");
}

TEST_F(ExchangeFaultTest, ADroppedConnectionIsClosedOrASerialLineGoesSilent) {
  break_all(WireFaultKind::kDroppedConnection);
  EXPECT_EQ(laser() + robot() + table(), "");
  EXPECT_TRUE(dashboard->is_dropped() && modbus->is_dropped() && obis->is_dropped());
  EXPECT_EQ(laser(), "") << "still down";
  world.pass(.06);
  EXPECT_EQ(laser(), "OK\r\n");
}

TEST_F(ExchangeFaultTest, SeveralInARow) {
  WireFault fault = fault_of(WireFaultKind::kLostRequest, WireDevice::kTable);
  fault.messages = 3;
  world.devices.faults().add(fault);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(table(), "");
  EXPECT_NE(table(), "");
}

TEST_F(ExchangeFaultTest, MessagesAreCountedFromOne) {
  WireFault fault = fault_of(WireFaultKind::kLostRequest, WireDevice::kTable);
  fault.trigger.at_message = 3;
  world.devices.faults().add(fault);
  EXPECT_NE(table(), "");
  EXPECT_NE(robot(), "");
  EXPECT_NE(table(), "");
  EXPECT_EQ(table(), "");
  EXPECT_NE(table(), "");
}

TEST(CellFaultTest, HappensAtItsTimeAndEnds) {
  WireWorld world;
  WireFault fault = fault_of(WireFaultKind::kInterlockOpen, WireDevice::kLaser, .5);
  fault.trigger.at_s = 2;
  world.devices.faults().add(fault);
  world.devices.cell().set_emission(true);
  world.pass(1.9);
  EXPECT_TRUE(world.devices.cell().is_interlock_closed());
  world.pass(.2);
  EXPECT_FALSE(world.devices.cell().is_interlock_closed());
  ASSERT_EQ(world.emissions.size(), 1u);
  EXPECT_NEAR(world.emissions[0].length_s, 2, 1e-12) << "at its instant, though time was looked at later";
  world.pass(1);
  EXPECT_TRUE(world.devices.cell().is_interlock_closed());
  EXPECT_TRUE(world.devices.cell().is_tripped());
}

TEST(CellFaultTest, HappensInAPhaseOfADot) {
  WireWorld world;
  TrueCell& cell = world.devices.cell();
  cell.set_modulation(TrueCell::Modulation::kWired);
  cell.set_emission(true);
  WireFault fault = fault_of(WireFaultKind::kInterlockOpen, WireDevice::kLaser, .01);
  fault.trigger.phase = CellPhase::kPulse;
  fault.trigger.occurrence = 2;
  fault.trigger.delay_s = .002;
  world.devices.faults().add(fault);
  const auto motion = world.converse(Conversation::kMotion);
  const auto dashboard = world.converse(Conversation::kDashboard);
  world.ask(*dashboard, "EnableRobot()");
  world.pass(1);
  for (int i = 0; i < 3; ++i) {
    world.ask(*motion, "DO(1,1)wait(5)DO(1,0)");
    world.pass(.1);
    cell.set_emission(true);
  }
  ASSERT_EQ(world.emissions.size(), 3u);
  EXPECT_NEAR(world.emissions[0].length_s, .005, 1e-12);
  EXPECT_NEAR(world.emissions[1].length_s, .002, 1e-12);
  EXPECT_NEAR(world.emissions[2].length_s, .005, 1e-12);
}

TEST(CellFaultTest, AxesJamAndDriftAndLimitsComeDown) {
  WireWorld world;
  TrueCell& cell = world.devices.cell();
  WireFault stuck = fault_of(WireFaultKind::kAxisStuck, WireDevice::kTable, 1);
  stuck.axis = kRotation;
  stuck.trigger.phase = CellPhase::kMoving;
  stuck.trigger.delay_s = .1;
  world.devices.faults().add(stuck);
  cell.move_axis(kRotation, 2);
  world.devices.observe();
  world.pass(.9);
  const double here = cell.position(kRotation);
  EXPECT_LT(here, 1);
  EXPECT_TRUE(cell.is_moving(kRotation));
  world.pass(1);
  EXPECT_FALSE(cell.is_moving(kRotation));
  EXPECT_EQ(cell.position(kRotation), here);

  WireFault drift = fault_of(WireFaultKind::kAxisDrift, WireDevice::kRobot, .1);
  drift.axis = kJ2;
  drift.amount = .02;
  world.devices.faults().add(drift);
  const double before = cell.position(kJ2);
  world.pass(1);
  EXPECT_NEAR(cell.position(kJ2) - before, .002, 1e-9);

  WireFault limit = fault_of(WireFaultKind::kPowerLimit, WireDevice::kLaser, .1);
  limit.amount = .25;
  world.devices.faults().add(limit);
  const auto obis = world.converse(Conversation::kLaser);
  EXPECT_EQ(world.ask(*obis, "SOUR:POW:LIM:HIGH?\r"), "0.050000\r\nOK\r\n");
  world.pass(.2);
  EXPECT_EQ(world.ask(*obis, "SOUR:POW:LIM:HIGH?\r"), "0.200000\r\nOK\r\n");
}

TEST(CellFaultTest, ClearingEndsWhatLasts) {
  WireWorld world;
  world.devices.faults().add(fault_of(WireFaultKind::kInterlockOpen, WireDevice::kLaser, 1000));
  EXPECT_FALSE(world.devices.cell().is_interlock_closed());
  world.devices.faults().clear();
  EXPECT_TRUE(world.devices.cell().is_interlock_closed());
}

TEST(FaultScriptFile, ReadsEveryKind) {
  const FaultScript script = fault_script_from_json(R"({"faults": [
      {"kind": "late_answer", "device": "table", "at_message": 40, "duration_ms": 300, "messages": 2},
      {"kind": "interlock_open", "phase": "pulse", "occurrence": 12, "delay_ms": 2, "duration_ms": 500},
      {"kind": "axis_drift", "at_s": 3.5, "axis": "j2", "speed_deg_s": 1.5, "duration_ms": 200},
      {"kind": "axis_stuck", "at_s": 3.5, "axis": "j3", "duration_ms": 200},
      {"kind": "stale_in_position", "device": "robot", "phase": "moving", "duration_ms": 80},
      {"kind": "device_alarm", "device": "table", "at_s": 1},
      {"kind": "power_limit", "at_s": 10, "share": 0.4, "duration_ms": 1000}]})",
                                                    "script");
  ASSERT_EQ(script.size(), 7u);
  EXPECT_EQ(script[0].kind, WireFaultKind::kLateAnswer);
  EXPECT_EQ(script[0].device, WireDevice::kTable);
  EXPECT_EQ(script[0].trigger.at_message, 40u);
  EXPECT_EQ(script[0].messages, 2u);
  EXPECT_DOUBLE_EQ(script[0].duration_s, .3);
  EXPECT_EQ(script[1].trigger.phase, CellPhase::kPulse);
  EXPECT_EQ(script[1].trigger.occurrence, 12u);
  EXPECT_DOUBLE_EQ(script[1].trigger.delay_s, .002);
  EXPECT_EQ(script[2].axis, kJ2);
  EXPECT_NEAR(script[2].amount, 1.5 * 3.14159265358979 / 180, 1e-9);
  EXPECT_EQ(script[3].axis, kJ3);
  EXPECT_DOUBLE_EQ(script[6].amount, .4);
}

TEST(FaultScriptFile, RefusesWhatItDoesNotMean) {
  const auto refusal = [](const std::string& fault) {
    try {
      fault_script_from_json("{\"faults\": [" + fault + "]}", "script");
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(refusal(R"({"kind": "silence", "device": "robot"})").find("has no trigger"), std::string::npos);
  EXPECT_NE(refusal(R"({"kind": "silent", "device": "robot", "at_s": 1})").find("$.faults[0].kind"),
            std::string::npos);
  EXPECT_NE(refusal(R"({"kind": "silence", "at_s": 1})").find("device"), std::string::npos);
  EXPECT_NE(refusal(R"({"kind": "silence", "device": "robot", "at_s": 1, "share": 1})").find("share"),
            std::string::npos);
  EXPECT_NE(refusal(R"({"kind": "axis_stuck", "at_s": 1, "duration_ms": 5})").find("axis"),
            std::string::npos);
  EXPECT_NE(refusal(R"({"kind": "device_alarm", "device": "laser", "at_s": 1})").find("no alarm"),
            std::string::npos);
  EXPECT_NE(refusal(R"({"kind": "silence", "device": "robot", "at_s": -1})").find("at_s"), std::string::npos);
}

}  // namespace
}  // namespace hilbrush
