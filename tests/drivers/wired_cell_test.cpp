#include "tests/drivers/wired_cell.h"

#include <cmath>

/// Whole devices: drivers and simulated devices that share nothing but the protocol's description.
namespace hilbrush::test {
namespace {

TEST(WiredCell, PaintsDotsWithEveryAxisAtRest) {
  WiredCell cell;
  cell.laser->connect();
  WiredCell::make_ready(*cell.robot);
  WiredCell::make_ready(*cell.table);
  cell.laser->enable();
  ASSERT_EQ(cell.laser->status().state, DeviceState::kReady);

  const Robot::Positions home = cell.robot->status().positions;
  const Table::Positions table_home = cell.table->status().positions;
  constexpr int kDots = 5;
  for (int i = 0; i < kDots; ++i) {
    Robot::Positions target = home;
    target[0] += .01 * (i + 1);
    target[2] -= .001 * i;
    Table::Positions table_target = table_home;
    table_target[1] += .02 * i;
    cell.robot->move_to(target, .03);
    cell.table->move_to(table_target, .03);
    ASSERT_TRUE(cell.wait_for([&] {
      return cell.robot->status().in_position && cell.table->status().in_position;
    })) << cell.robot->status().fault
        << cell.table->status().fault;
    for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(cell.robot->status().positions[k], target[k], 1e-4);
    cell.laser->fire(.02 + .001 * i, .005);
    ASSERT_TRUE(cell.wait_for([&] { return !cell.laser->status().is_emitting; }));
    EXPECT_EQ(cell.laser->status().state, DeviceState::kReady) << cell.laser->status().fault;
    EXPECT_TRUE(cell.laser->off());
  }
  cell.laser->disable();
  const auto emissions = cell.emissions();
  ASSERT_EQ(emissions.size(), std::size_t{kDots});
  for (int i = 0; i < kDots; ++i) {
    const Emission& emission = emissions[static_cast<std::size_t>(i)];
    EXPECT_FALSE(emission.is_moving) << i;
    EXPECT_NEAR(emission.length_s, .005, 1e-3);
    EXPECT_NEAR(emission.power_w, .02 + .001 * i, 1e-6);
    EXPECT_NEAR(emission.joints[kJ1], home[0] + .01 * (i + 1), 1e-5);
    EXPECT_NEAR(emission.joints[kRotation], table_home[1] + .02 * i, 1e-5);
  }
}

}  // namespace
}  // namespace hilbrush::test
