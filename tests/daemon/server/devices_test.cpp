#include <gtest/gtest.h>

#include "config/rpc_errors.h"
#include "tests/daemon/execution/sim_devices.h"
#include "tests/daemon/server/daemon_fixture.h"

/// Devices that fail at rest and in a job.
namespace hilbrush {
namespace {

namespace fs = std::filesystem;
using test::DaemonWorld;
using test::Json;
using test::LineClient;
using test::placed;

/// The daemon on devices of the test's own.
class ServerDevicesTest : public ::testing::Test {
 protected:
  void begin(double time_scale = 0) {
    world.options.time_scale = time_scale;
    world.options.make_devices = [this](const CellDescription& description) {
      auto made = std::make_unique<test::SimDevices>(description);
      devices = made.get();
      return made;
    };
    world.begin();
    client.emplace(world.options.socket);
  }
  Json wait_for_state(const std::string& state) {
    const auto deadline = std::chrono::steady_clock::now() + LineClient::kPatience;
    for (;;) {
      const Json cell = client->result("cell.status").at("cell");
      if (cell.at("state") == state) return cell;
      if (std::chrono::steady_clock::now() > deadline) throw std::runtime_error("the cell is " + cell.dump());
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }
  test::SimDevices* devices = nullptr;
  DaemonWorld world;
  std::optional<LineClient> client;
};

TEST_F(ServerDevicesTest, AnInterlockOpenedWhileArmedIsAStopThatLatches) {
  begin();
  client->result("cell.clear");
  devices->sim.set_interlock_closed(false);
  std::this_thread::sleep_for(std::chrono::milliseconds(150));
  EXPECT_EQ(client->result("cell.status").at("cell").at("state"), "idle") << "a part may be changed at rest";
  devices->sim.set_interlock_closed(true);
  client->result("cell.arm");
  devices->sim.set_interlock_closed(false);
  const Json cell = wait_for_state("stopped");
  EXPECT_NE(cell.at("reason").get<std::string>().find("interlock"), std::string::npos);
  devices->sim.set_interlock_closed(true);
  std::this_thread::sleep_for(std::chrono::milliseconds(150));
  EXPECT_EQ(client->result("cell.status").at("cell").at("state"), "stopped");
  EXPECT_EQ(client->error_code("cell.arm"), kRpcWrongState);
  world.clear_and_arm(*client);
}

TEST_F(ServerDevicesTest, ADeviceThatFailsAtRestStopsTheCellAndIsBroughtBackByClear) {
  begin();
  client->result("cell.clear");
  devices->sim.fail_robot("the link was lost");
  const Json cell = wait_for_state("stopped");
  EXPECT_NE(cell.at("reason").get<std::string>().find("the link was lost"), std::string::npos);
  std::ifstream in(world.options.state / "audit.log");
  const std::string log((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  EXPECT_NE(log.find("\"user\":\"hilbrushd\""), std::string::npos) << "a stop of its own is recorded, too";
  world.clear_and_arm(*client);
  EXPECT_EQ(client->result("cell.status").at("cell").at("devices").at("robot").at("state"), "ready");
}

TEST_F(ServerDevicesTest, ADeviceThatFailsInAJobPausesItAndTheJobGoesOn) {
  begin(.02);
  const auto id = world.submit(*client, world.model("cup.wrl", 600), "ready");
  world.clear_and_arm(*client);
  client->result("job.start", placed(id));
  for (int round = 0; round < 3; ++round) {
    const int before = client->result("job.get", {{"id", id}}).at("job").at("dots").at("exposed").get<int>();
    while (client->result("job.get", {{"id", id}}).at("job").at("dots").at("exposed").get<int>() <
           before + 30)
      std::this_thread::yield();
    if (round == 0) devices->sim.fail_table("overload");
    if (round == 1) devices->sim.set_interlock_closed(false);
    if (round == 2) devices->sim.fail_robot("collision");
    const Json job = world.wait_for(*client, id, "paused");
    EXPECT_FALSE(job.at("error").is_null());
    EXPECT_TRUE(job.at("needs_part_in_place").get<bool>());
    EXPECT_LE(job.at("dots").at("in_doubt").get<int>(), round + 1);
    devices->sim.set_interlock_closed(true);
    world.clear_and_arm(*client);
    EXPECT_EQ(client->error_code("job.resume", {{"id", id}}), kRpcWrongState);
    client->result("job.resume", placed(id));
  }
  const Json job = world.wait_for(*client, id, "done");
  EXPECT_EQ(job.at("dots").at("exposed").get<int>() + job.at("dots").at("in_doubt").get<int>(), 600);
  ASSERT_TRUE(job.at("timing").is_object());
  EXPECT_GT(job.at("timing").at("own_ms").at("p99").get<double>(), 0);
  const Json& measured = job.at("timing").at("measured");
  EXPECT_GE(measured.at("move_delay_ms").get<double>(), 0);
  EXPECT_EQ(measured.size(), 2u) << "as it may stand in a cell file";
  EXPECT_TRUE(job.at("timing").at("measured_is_enough").is_boolean());
  EXPECT_EQ(job.at("timing").at("measured_moves").size(), measured.at("time_factor").size());
  for (const auto& emission : read_emission_record(world.job_folder(id) / "emissions.ply"))
    EXPECT_FALSE(emission.is_moving);
}

}  // namespace
}  // namespace hilbrush
