#include <fcntl.h>
#include <sys/select.h>
#include <unistd.h>

#include "config/register_map_file.h"
#include "drivers/axes/mapped_drive.h"
#include "tests/drivers/modbus_peer.h"
#include "tests/drivers/wired_cell.h"

/// Positioning axes over Modbus TCP, each with its maker's table of registers, against the simulated ones.
namespace hilbrush::test {
namespace {

constexpr const char* kHere = HILBRUSH_SOURCE_DIR;

WireOptions with_table(WireOptions::Table table) {
  WireOptions options = WiredCell::quick();
  options.table = table;
  return options;
}

class WiredAxes : public testing::TestWithParam<WireOptions::Table> {
 protected:
  WiredAxes() : cell(with_table(GetParam())) {
    if (cell.table) {
      table = std::move(cell.table);
      return;
    }
    auto options = cell.axis_options();
    for (auto& axis : options) axis.homes_to_zero = GetParam() == WireOptions::Table::kLeadshinePr;
    const RegisterMap map =
        load_register_map(std::string(kHere) + "/config/axes/" + cell.wire.endpoints().table_map + ".json");
    auto bus = std::make_shared<ModbusBus>(options[0].endpoint);
    std::array<std::unique_ptr<AxisDrive>, 2> drives{
        std::make_unique<MappedDrive>(bus, options[0], map, cell.clock),
        std::make_unique<MappedDrive>(bus, options[1], map, cell.clock)};
    table = std::make_unique<DriveGroup<2>>("table", options, std::move(drives), cell.clock);
  }
  void move(const Table::Positions& target) {
    table->move_to(target, .02);
    ASSERT_TRUE(cell.wait_for([&] { return table->status().in_position; })) << table->status().fault;
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_NEAR(table->status().positions[i], target[i], 1e-5);
      cell.wire.act([&](TrueCell& truth) {
        EXPECT_NEAR(truth.position(kTilt + i), target[i], 1e-5);
        EXPECT_TRUE(truth.is_settled(kTilt + i));
      });
    }
  }

  WiredCell cell;
  std::unique_ptr<DriveGroup<2>> table;
};

TEST_P(WiredAxes, GoWhereTheyAreSentOnBothSidesOfZero) {
  WiredCell::make_ready(*table);
  move({.1, .3});
  move({.1, -.5});
  move({-.1, -.5});
  move({0, 2});
  EXPECT_EQ(table->identify().size(), 2u);
}

TEST_P(WiredAxes, StopOnTheWayAndGoOn) {
  WiredCell::make_ready(*table);
  table->move_to({.5, 20}, .02);
  ASSERT_TRUE(cell.wait_for([&] { return table->status().positions[1] > .2; }));
  table->stop();
  table->stop();
  EXPECT_FALSE(table->status().in_position);
  bool is_moving = true;
  EXPECT_TRUE(cell.wait_for([&] {
    cell.wire.act([&](TrueCell& truth) { is_moving = truth.is_moving(kTilt) || truth.is_moving(kRotation); });
    return !is_moving;
  }));
  EXPECT_LT(table->status().positions[1], 15);
  move({.1, .3});
}

TEST_P(WiredAxes, NothingMovesByWhatIsWrittenAhead) {
  WiredCell::make_ready(*table);
  move({.1, .3});
  const auto stay = [&] {
    cell.clock.sleep_until(cell.clock.now_s() + 1);
    EXPECT_TRUE(table->status().in_position);
    cell.wire.act([&](TrueCell& truth) {
      EXPECT_TRUE(truth.is_settled(kTilt) && truth.is_settled(kRotation));
      EXPECT_NEAR(truth.position(kTilt), .1, 1e-5);
      EXPECT_NEAR(truth.position(kRotation), .3, 1e-5);
    });
  };
  table->prepare({.2, .5});
  stay();
  move({.2, .5});
  move({.1, .3});
  table->prepare({.2, .5});
  stay();
  table->stop();
  cell.clock.sleep_until(cell.clock.now_s() + 1);
  cell.wire.act([&](TrueCell& truth) { EXPECT_NEAR(truth.position(kRotation), .3, 1e-5); });
  move({.15, .5});
  move({.1, .3});
  table->prepare({.2, .5});
  move({.1, .4});
}

TEST_P(WiredAxes, RefuseWhatIsOutsideTheirLimits) {
  WiredCell::make_ready(*table);
  EXPECT_THROW(table->move_to({1.9, 0}, .02), DriverError);
  EXPECT_THROW(table->move_to({0, std::numeric_limits<double>::quiet_NaN()}, .02), DriverError);
  EXPECT_THROW(table->move_to({0, 0}, -1), DriverError);
  EXPECT_EQ(table->status().state, DeviceState::kReady);
}

TEST_P(WiredAxes, AnAlarmIsAFaultThatCanBeCleared) {
  WiredCell::make_ready(*table);
  cell.begin_fault(WireFaultKind::kDeviceAlarm, WireDevice::kTable);
  ASSERT_TRUE(cell.wait_for([&] { return table->status().state == DeviceState::kFault; }));
  EXPECT_FALSE(table->status().fault.empty());
  cell.wire.clear_faults();
  table->clear_fault();
  EXPECT_EQ(table->status().state, DeviceState::kConnected);
  table->enable();
  table->home();
  move({.1, .3});
}

TEST_P(WiredAxes, AnAlarmFromBeforeIsReportedAtOnceAndCanBeCleared) {
  cell.begin_fault(WireFaultKind::kDeviceAlarm, WireDevice::kTable);
  EXPECT_THROW(table->connect(), DriverError);
  EXPECT_EQ(table->status().state, DeviceState::kFault);
  table->clear_fault();
  table->enable();
  table->home();
  move({.1, .3});
}

TEST_P(WiredAxes, ALostConnectionIsAFaultThatCanBeCleared) {
  WiredCell::make_ready(*table);
  cell.begin_fault(WireFaultKind::kDroppedConnection, WireDevice::kTable);
  ASSERT_TRUE(cell.wait_for([&] { return table->status().state == DeviceState::kFault; }));
  EXPECT_NE(table->status().fault.find("last messages"), std::string::npos) << table->status().fault;
  cell.wire.clear_faults();
  table->clear_fault();
  table->enable();
  table->home();
  move({.1, .3});
}

/// More clients than select() can count must not end the daemon when the table is connected again.
TEST(ModbusBusTest, TooManyDescriptorsAreASentence) {
  ModbusPeer peer([](ModbusPeer::Registers&) {});
  ModbusEndpoint endpoint;
  endpoint.host = "127.0.0.1";
  endpoint.tcp_port = peer.port();
  ModbusBus bus(endpoint);
  std::vector<int> open;
  do open.push_back(::open("/dev/null", O_RDONLY | O_CLOEXEC));
  while (open.back() >= 0 && open.back() < FD_SETSIZE);
  std::string sentence;
  try {
    bus.connect();
  } catch (const LinkError& error) {
    sentence = error.what();
  }
  for (const int descriptor : open)
    if (descriptor >= 0) ::close(descriptor);
  EXPECT_NE(sentence.find("too many files and clients"), std::string::npos) << sentence;
  bus.connect();
  EXPECT_TRUE(bus.is_open());
}

INSTANTIATE_TEST_SUITE_P(Maps, WiredAxes,
                         testing::Values(WireOptions::Table::kOrientalAz, WireOptions::Table::kCia402,
                                         WireOptions::Table::kLeadshinePr),
                         [](const auto& tested) {
                           return std::string(
                               std::array{"OrientalAz", "Cia402",
                                          "LeadshinePr"}[static_cast<std::size_t>(tested.param)]);
                         });

}  // namespace
}  // namespace hilbrush::test
