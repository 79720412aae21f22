#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "config/register_map_file.h"
#include "drivers/axes/drive_group.h"
#include "drivers/axes/mapped_drive.h"
#include "drivers/axes/oriental_az.h"
#include "drivers/driver_error.h"
#include "drivers/steady_clock.h"
#include "tests/drivers/modbus_peer.h"

/// The set-point that goes ahead of a move while light is on: which bytes, that nothing moves by them, and
/// that whatever comes between makes the next order a whole one.
namespace hilbrush::test {
namespace {

using Writes = std::vector<std::string>;

std::array<ModbusAxisOptions, 2> axis_options(std::uint16_t port) {
  std::array<ModbusAxisOptions, 2> options;
  for (int i = 0; i < 2; ++i) {
    ModbusAxisOptions& axis = options[static_cast<std::size_t>(i)];
    axis.endpoint.host = "127.0.0.1";
    axis.endpoint.tcp_port = port;
    axis.unit = 1 + i;
    axis.scale.steps_per_unit = 1e4;
    axis.bounds = {-2, 2, 1, 10};
    axis.window = 1e-4;
  }
  return options;
}

template <class MakeDrive>
std::unique_ptr<DriveGroup<2>> make_group(std::uint16_t port, Clock& clock, MakeDrive make_drive) {
  const auto options = axis_options(port);
  auto bus = std::make_shared<ModbusBus>(options[0].endpoint);
  std::array<std::unique_ptr<AxisDrive>, 2> drives{make_drive(bus, options[0]), make_drive(bus, options[1])};
  return std::make_unique<DriveGroup<2>>("table", options, std::move(drives), clock);
}

/// Until it holds, ten wall seconds at most.
template <class Condition>
bool comes_true(Condition condition) {
  for (int i = 0; i < 10'000; ++i) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return false;
}

/// Two AZ drives that are where they were sent as soon as they are triggered.
class OrientalAhead : public testing::Test {
 protected:
  OrientalAhead() {
    for (const int unit : {1, 2}) peer.set(unit, oriental_az::kDriverOutputAt, kInPlace);
    make_ready();
    go({0, 0});
  }
  static void obey(ModbusPeer::Registers& registers) {
    constexpr int kPositionDataAt = 0x5C;
    if (registers[oriental_az::kTriggerAt + 1] != 1) return;
    registers[oriental_az::kTriggerAt + 1] = 0;
    for (const int word : {0, 1})
      registers[oriental_az::kPositionAt + word] = registers[oriental_az::kPositionAt + 2 + word] =
          registers[kPositionDataAt + word];
  }
  void make_ready() {
    table->connect();
    table->enable();
    table->home();
  }
  void go(const Table::Positions& target) {
    table->move_to(target, 0);
    ASSERT_TRUE(comes_true([&] { return table->status().in_position; })) << table->status().fault;
  }
  /// What is written by it; nothing moves.
  Writes prepared(const Table::Positions& target) {
    const auto positions = table->status().positions;
    peer.take_writes();
    table->prepare(target);
    Writes writes;
    // The polling thread reads on when it has noted what it wrote.
    EXPECT_TRUE(comes_true([&] {
      for (auto& write : peer.take_writes()) writes.push_back(std::move(write));
      return !writes.empty() && peer.reads_since_write() > 0;
    }));
    EXPECT_TRUE(table->status().in_position);
    EXPECT_EQ(table->status().positions, positions);
    return writes;
  }

  static constexpr std::uint16_t kInPlace = oriental_az::kInPosition | oriental_az::kReady;
  /// 0.1 rad are 1,000 steps; 10,000 steps/s, 100,000 steps/s2.
  static constexpr const char* kWhole =
      "01 10 00 58 00 10 20 00 00 00 00 00 00 00 01 00 00 03 E8 00 00 27 10 00 01 86 A0 00 01 86 A0 00 00 03 "
      "E8 "
      "00 00 00 01";
  static constexpr const char* kAhead =
      "01 10 00 58 00 10 20 00 00 00 00 00 00 00 01 00 00 03 E8 00 00 27 10 00 01 86 A0 00 01 86 A0 00 00 03 "
      "E8 "
      "00 00 00 00";
  static constexpr const char* kTrigger = "01 10 00 66 00 02 04 00 00 00 01";

  ModbusPeer peer{obey};
  SteadyClock clock;
  std::unique_ptr<DriveGroup<2>> table = make_group(
      peer.port(), clock,
      [](const auto& bus, const auto& options) { return std::make_unique<OrientalDrive>(bus, options); });
};

TEST_F(OrientalAhead, DataGoAheadWithTheTriggerAtNoneAndTheTriggerAloneStarts) {
  EXPECT_EQ(prepared({.1, 0}), Writes{kAhead}) << "of the axis that will move, and of no other";
  go({.1, 0});
  EXPECT_EQ(peer.take_writes(), Writes{kTrigger});
}

TEST_F(OrientalAhead, WithoutAnythingAheadAMoveIsOneWrite) {
  peer.take_writes();
  go({.1, 0});
  EXPECT_EQ(peer.take_writes(), Writes{kWhole});
}

TEST_F(OrientalAhead, AnotherTargetIsSentWhole) {
  prepared({.2, 0});
  go({.1, 0});
  EXPECT_EQ(peer.take_writes(), Writes{kWhole});
}

TEST_F(OrientalAhead, WhatIsAheadStaysThroughAnOrderToStay) {
  prepared({.1, 0});
  go({0, 0});
  EXPECT_EQ(peer.take_writes(), Writes{});
  go({.1, 0});
  EXPECT_EQ(peer.take_writes(), Writes{kTrigger});
}

TEST_F(OrientalAhead, AStopForgetsIt) {
  prepared({.1, 0});
  table->stop();
  peer.take_writes();
  go({.1, 0});
  const Writes writes = peer.take_writes();
  // The stop's level is taken back first; the second axis, too, has no target any more.
  ASSERT_EQ(writes.size(), 4u);
  EXPECT_EQ(writes[0], "01 10 00 7D 00 01 02 00 00");
  EXPECT_EQ(writes[1], kWhole);
}

TEST_F(OrientalAhead, AFaultForgetsIt) {
  prepared({.1, 0});
  peer.set(2, oriental_az::kDriverOutputAt, oriental_az::kAlarm);
  ASSERT_TRUE(comes_true([&] { return table->status().state == DeviceState::kFault; }));
  peer.set(2, oriental_az::kDriverOutputAt, kInPlace);
  table->clear_fault();
  table->enable();
  table->home();
  peer.take_writes();
  go({.1, 0});
  EXPECT_EQ(peer.take_writes().front(), kWhole);
}

TEST_F(OrientalAhead, AWriteWithoutAnAnswerCountsAsNone) {
  peer.be_silent(1);
  prepared({.1, 0});
  EXPECT_EQ(table->status().state, DeviceState::kReady) << table->status().fault;
  go({.1, 0});
  EXPECT_EQ(peer.take_writes(), Writes{kWhole});
}

TEST_F(OrientalAhead, NothingGoesAheadOfATableThatIsNotReadyOrOutsideItsLimits) {
  EXPECT_THROW(table->prepare({3, 0}), DriverError);
  table->disable();
  peer.take_writes();
  const std::size_t reads = peer.reads_since_write();
  table->prepare({.1, 0});
  ASSERT_TRUE(comes_true([&] { return peer.reads_since_write() > reads + 2; }));
  EXPECT_EQ(peer.take_writes(), Writes{});
}

/// A drive of few registers: 1 trigger, 2 status, 10 target, 12 speed, 20 position.
constexpr const char* kMap = R"({
  "name": "plain", "word_order": "high_first",
  "registers": {"trigger": {"address": 1}, "status": {"address": 2},
                "target": {"address": 10, "words": 2, "signed": true}, "speed": {"address": 12, "words": 2},
                "position": {"address": 20, "words": 2, "signed": true}},
  "position": "position",
  "enabled": [], "homed": [], "arrived": [{"register": "status", "mask": 1, "equals": 1}],
  "enable": [], "disable": [], "home": [],
  "prepare": [{"write": "speed", "from": "speed"}, {"write": "target", "from": "target"}],
  "move": [{"write": "trigger", "value": 1}],
  "stop": [{"write": "trigger", "value": 2}], "clear_fault": []
})";

TEST(MappedAhead, ItsListOfPreparationsGoesAheadAndTheRestStarts) {
  ModbusPeer peer([](ModbusPeer::Registers& registers) {
    if (registers[1] != 1) return;
    registers[1] = 0;
    for (const int word : {0, 1}) registers[20 + word] = registers[10 + word];
  });
  for (const int unit : {1, 2}) peer.set(unit, 2, 1);
  SteadyClock clock;
  const RegisterMap map = register_map_from_json(kMap, "map.json");
  const auto table = make_group(peer.port(), clock, [&](const auto& bus, const auto& options) {
    return std::make_unique<MappedDrive>(bus, options, map, clock);
  });
  table->connect();
  table->enable();
  table->home();
  const auto go = [&](const Table::Positions& target) {
    table->move_to(target, 0);
    ASSERT_TRUE(comes_true([&] { return table->status().in_position; })) << table->status().fault;
  };
  go({0, 0});
  peer.take_writes();
  table->prepare({0, -.1});
  Writes ahead;
  ASSERT_TRUE(comes_true([&] {
    for (auto& write : peer.take_writes()) ahead.push_back(std::move(write));
    return ahead.size() >= 2 && peer.reads_since_write() > 0;
  }));
  EXPECT_EQ(ahead, (Writes{"02 10 00 0C 00 02 04 00 00 27 10", "02 10 00 0A 00 02 04 FF FF FC 18"}));
  go({0, -.1});
  EXPECT_EQ(peer.take_writes(), Writes{"02 10 00 01 00 01 02 00 01"});
  go({0, .1});
  EXPECT_EQ(peer.take_writes().size(), 3u) << "nothing was ahead";
}

}  // namespace
}  // namespace hilbrush::test
