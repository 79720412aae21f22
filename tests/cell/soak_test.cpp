#include <gtest/gtest.h>

#include <iostream>
#include <random>
#include <set>

#include "planner/cell_model/program_file.h"
#include "tests/cell/fault_plan.h"
#include "tests/cell/wired_world.h"
#include "tests/cell/witness.h"
#include "tests/daemon/server/soak_support.h"

/// The daemon with its real drivers on wires, for long: jobs, faults of every kind, connections that are lost
/// and made again, stops, the daemon's own restarts, clients that mean no good. HILBRUSH_LONG=1 makes it an
/// hour, HILBRUSH_SOAK_S=N makes it N seconds.
namespace hilbrush {
namespace {

using test::DaemonWorld;
using test::Json;
using test::LineClient;
using test::WiredWorld;

constexpr double kTimeScale = .05;

class WireSoak {
 public:
  explicit WireSoak(unsigned seed) : random_(seed) {
    daemons_.options.cell = wires_.cell_file().string();
    daemons_.options.time_scale.reset();  // the cell file's
    models_ = {daemons_.model("cup.wrl", 80), daemons_.model("bowl.wrl", 160)};
    daemons_.begin();
  }

  void paint_one_job() {
    constexpr unsigned kRestartEvery = 20;
    if (random_() % kRestartEvery == 0) restart();
    LineClient client(daemons_.options.socket);
    const std::string id = daemons_.submit(client, models_[random_() % models_.size()], "ready");
    wires_.take_emissions();
    story_.clear();
    set_going(client, id);
    for (;;) {
      const std::string now = test::job_state(client, id);
      if (now == "done") break;
      if (now == "failed") throw std::runtime_error(client.result("job.get", {{"id", id}}).dump());
      if (now == "paused") set_going(client, id);
      if (random_() % 60 == 0) disturb(client, id);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    check(client.result("job.get", {{"id", id}}).at("job"), id);
  }

  DaemonWorld& world() { return daemons_; }
  std::size_t disturbances = 0;
  std::size_t lost_connections = 0;
  std::size_t restarts = 0;
  std::size_t dots = 0;
  std::size_t doubts = 0;

 private:
  void restart() {
    daemons_.end();
    daemons_.begin();
    ++restarts;
  }

  void set_going(LineClient& client, const std::string& id) {
    test::set_going(client, id, [this] { wires_.wire().clear_faults(); });
  }

  void disturb(LineClient& client, const std::string& id) {
    ++disturbances;
    if (random_() % 8 == 0) {
      client.result("cell.stop");
      return;
    }
    if (random_() % 8 == 0) {
      client.call("job.pause", {{"id", id}});
      return;
    }
    WireFault fault = test::random_fault(random_, 3);  // in a phase of the next dots
    if (random_() % 3 == 0) fault.kind = WireFaultKind::kDroppedConnection;
    if (fault.kind == WireFaultKind::kDroppedConnection) ++lost_connections;
    story_ += test::described(fault) + "\n";
    wires_.wire().add_fault(test::in_wall_time(fault, kTimeScale));
  }

  /// The witness against the counts.
  void check(const Json& job, const std::string& id) {
    const ExposureProgram program = read_program(daemons_.job_folder(id) / "program.ply");
    // A lost end of a pulse lasts until it is seen; an axis that drifts a little is still in position.
    const test::WitnessOptions options{.joint_tolerance = 3e-3, .overrun_s = .3 / kTimeScale};
    SCOPED_TRACE("job " + id + "\n" + story_);
    const auto testimony = test::hear_witness(program, wires_.take_emissions(), options);
    EXPECT_EQ(testimony.in_motion, 0u);
    EXPECT_EQ(testimony.strays, 0u);
    EXPECT_EQ(testimony.too_long, 0u) << testimony.longest_overrun_s;
    const auto in_doubt = job.at("in_doubt").get<std::set<std::size_t>>();
    EXPECT_EQ(job.at("dots").at("exposed").get<std::size_t>() + in_doubt.size(), program.exposures.size());
    for (std::size_t i = 0; i < program.exposures.size(); ++i) {
      ASSERT_LE(testimony.light[i], 1) << "dot " << i;
      ASSERT_TRUE(testimony.is_whole[i] || in_doubt.contains(i))
          << "dot " << i << ", lit " << testimony.light[i] << " times";
    }
    dots += program.exposures.size();
    doubts += in_doubt.size();
  }

  std::mt19937 random_;
  std::string story_;  ///< of the faults in the job under way
  WiredWorld wires_{WiredWorld::quick(kTimeScale), WiredWorld::Drivers::kNone};
  DaemonWorld daemons_;
  std::vector<std::filesystem::path> models_;
};

TEST(WireSoakTest, FaultsReconnectionsAndClientsLeaveNoTraceAndCountsAreTrue) {
  const unsigned seed = 77;
  SCOPED_TRACE(seed);
  WireSoak soak(seed);
  const test::SoakTrace trace =
      test::soak(soak.world(), test::soak_length(12), [&] { soak.paint_one_job(); });
  std::cout << trace.jobs << " jobs, " << soak.dots << " dots, " << soak.doubts << " in doubt, "
            << soak.disturbances << " disturbances, " << soak.lost_connections << " lost connections, "
            << soak.restarts << " restarts, " << trace << "\n";
  test::expect_no_trace(trace);
}

}  // namespace
}  // namespace hilbrush
