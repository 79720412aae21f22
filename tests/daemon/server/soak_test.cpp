#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <iostream>
#include <map>
#include <random>

#include "planner/cell_model/program_file.h"
#include "sim/devices/emission_record.h"
#include "tests/daemon/execution/sim_devices.h"
#include "tests/daemon/server/daemon_fixture.h"
#include "tests/daemon/server/soak_support.h"

/// The daemon under everything at once, for long: jobs one after another, faults, stops, restarts of the
/// cell, clients that come, send garbage and go. HILBRUSH_LONG=1 makes it an hour, HILBRUSH_SOAK_S=N makes it
/// N seconds.
namespace hilbrush {
namespace {

namespace fs = std::filesystem;
using test::DaemonWorld;
using test::Json;
using test::LineClient;

class Soak {
 public:
  explicit Soak(unsigned seed) : random_(seed) {
    world_.options.time_scale = 0.01;
    world_.options.make_devices = [this](const CellDescription& description) {
      auto made = std::make_unique<test::SimDevices>(description);
      devices_ = made.get();
      return made;
    };
    models_ = {world_.model("cup.wrl", 150), world_.model("long.wrl", 60), world_.model("bowl.wrl", 300)};
    world_.begin();
  }

  void paint_one_job() {
    LineClient client = world_.client();
    const int copies = random_() % 4 == 0 ? 2 : 1;
    const fs::path model = models_[random_() % models_.size()];
    const auto id =
        client
            .result("job.submit",
                    {{"model", model.string()}, {"settings", {{"size_mm", 80}}}, {"copies", copies}})
            .at("job")
            .at("id")
            .get<std::string>();
    if (random_() % 4 == 0) client.call("job.submit", {{"model", "/no/such.wrl"}});
    world_.wait_for(client, id, "ready");
    for (int copy = 1; copy <= copies; ++copy) paint_copy(client, id, copy, copy == copies);
    ++jobs;
  }

  DaemonWorld& world() { return world_; }
  std::size_t jobs = 0;
  std::size_t disturbances = 0;
  std::size_t doubts = 0;

 private:
  void set_going(LineClient& client, const std::string& id) {
    test::set_going(client, id, [this] { devices_->sim.set_interlock_closed(true); });
  }

  void disturb(LineClient& client, const std::string& id) {
    ++disturbances;
    switch (random_() % 6) {
      case 0:
        client.result("cell.stop");
        break;
      case 1:
        devices_->sim.fail_robot("following error");
        break;
      case 2:
        devices_->sim.fail_table("the link was lost");
        break;
      case 3:
        devices_->sim.set_interlock_closed(false);
        break;
      case 4:
        client.call("job.pause", {{"id", id}});
        break;
      default:
        client.call("cell.home");  // refused while painting
    }
  }

  void paint_copy(LineClient& client, const std::string& id, int copy, bool is_last) {
    set_going(client, id);
    Json job;
    for (;;) {
      job = client.result("job.get", {{"id", id}}).at("job");
      const auto now = job.at("state").get<std::string>();
      if (now == "done" || job.at("copies_done").get<int>() >= copy) break;
      if (now == "failed") throw std::runtime_error(job.dump());
      if (now == "paused") set_going(client, id);
      if (random_() % 40 == 0) disturb(client, id);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    check_copy(id, copy, is_last ? job : Json());
  }

  /// The witness against the counts.
  void check_copy(const std::string& id, int copy, const Json& job) {
    const fs::path folder = world_.job_folder(id);
    const auto program = read_program(folder / "program.ply");
    std::map<std::array<long long, kAxisCount>, int> counts;
    const auto key = [](const Joints& joints) {
      std::array<long long, kAxisCount> rounded{};
      for (std::size_t i = 0; i < kAxisCount; ++i) rounded[i] = std::llround(joints[i] * 1e10);
      return rounded;
    };
    const auto file =
        folder / ("emissions" + (copy > 1 ? "-" + std::to_string(copy) : std::string()) + ".ply");
    for (const auto& emission : read_emission_record(file)) {
      ASSERT_FALSE(emission.is_moving);
      ASSERT_EQ(++counts[key(emission.joints)], 1) << "a dot twice";
    }
    const std::size_t lit = counts.size();
    ASSERT_LE(lit, program.exposures.size());
    if (!job.is_object()) return;
    const auto exposed = job.at("dots").at("exposed").get<std::size_t>();
    const auto in_doubt = job.at("dots").at("in_doubt").get<std::size_t>();
    doubts += in_doubt;
    ASSERT_EQ(exposed + in_doubt, program.exposures.size());
    ASSERT_GE(lit, exposed);
    ASSERT_LE(lit, exposed + in_doubt);
    for (const auto& i : job.at("in_doubt"))
      counts.erase(key(program.exposures[i.get<std::size_t>()].joints));
    ASSERT_EQ(counts.size(), exposed);
  }

  std::mt19937 random_;
  test::SimDevices* devices_ = nullptr;
  DaemonWorld world_;
  std::vector<fs::path> models_;
};

TEST(SoakTest, JobsFaultsAndClientsLeaveNoTraceInMemoryOrDescriptorsAndCountsAreTrue) {
  const unsigned seed = 31;
  SCOPED_TRACE(seed);
  Soak soak(seed);
  const test::SoakTrace trace =
      test::soak(soak.world(), test::soak_length(12), [&] { soak.paint_one_job(); });
  std::cout << soak.jobs << " jobs, " << soak.disturbances << " disturbances, " << soak.doubts
            << " dots in doubt, " << trace << "\n";
  test::expect_no_trace(trace);
}

}  // namespace
}  // namespace hilbrush
