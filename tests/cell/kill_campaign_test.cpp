#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <random>
#include <set>
#include <thread>

#include "planner/cell_model/program_file.h"
#include "tests/cell/wired_world.h"
#include "tests/cell/witness.h"
#include "tests/daemon/server/daemon_process.h"

/// hilbrushd killed with SIGKILL at random moments of a job over the wire, begun again, and the job resumed:
/// by the emissions' record no dot is lit twice, none is lost, and each kill leaves at most one in doubt.
/// HILBRUSH_LONG: 200 kills of a job in real time.
namespace hilbrush {
namespace {

using test::connect;
using test::DaemonProcess;
using test::DaemonWorld;
using test::Json;
using test::LineClient;

class KillCampaign : public testing::Test {
 protected:
  static bool is_long() { return std::getenv("HILBRUSH_LONG") != nullptr; }

  Json job(LineClient& client) { return client.result("job.get", {{"id", id_}}).at("job"); }
  /// What an operator does until the job is being painted, or done. On a busy machine the laser's guard may
  /// have turned it off meanwhile: then all three acts are made again.
  void start(LineClient& client) {
    constexpr int kAttempts = 200;
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
      const bool is_ready = client.error_code("cell.clear") == 0 && client.error_code("cell.arm") == 0;
      const bool is_first = job(client).at("state") == "ready";
      if (is_ready)
        client.error_code(is_first ? "job.start" : "job.resume", {{"id", id_}, {"part_in_place", true}});
      for (;;) {
        const Json now = job(client);
        if (now.at("state") == "done" || (now.at("state") == "painting" && now.at("stage") == "paint"))
          return;
        if (now.at("state") == "failed") throw std::runtime_error("the job failed: " + now.dump());
        if (now.at("state") == "paused" || now.at("state") == "ready") break;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    throw std::runtime_error("the job cannot be begun");
  }
  void finish(LineClient& client) {
    while (job(client).at("state") != "done") {
      start(client);
      while (job(client).at("state") == "painting") std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }

  const double time_scale_ = is_long() ? 1 : .05;
  const int kills_ = is_long() ? 200 : 8;
  const std::size_t dots_ = is_long() ? 4000 : 600;
  test::WiredWorld world_{test::WiredWorld::quick(time_scale_), test::WiredWorld::Drivers::kNone};
  DaemonWorld daemons_;
  std::string id_;
};

TEST_F(KillCampaign, NoDotTwiceNoneLostAtMostOneInDoubtEach) {
  if (!test::is_built()) GTEST_SKIP() << "hilbrushd is not built";
  const unsigned seed = 20261;
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  daemons_.options.cell = world_.cell_file().string();
  daemons_.options.time_scale.reset();  // the cell file's
  {
    const DaemonProcess daemon(daemons_.options);
    const auto client = connect(daemons_.options, 4000);
    id_ = daemons_.submit(*client, daemons_.model("cup.wrl", dots_), "ready");
  }
  const double kill_after_max_s = is_long() ? 1 : .06;
  std::size_t last_done = 0;
  std::size_t doubts = 0;
  int kills = 0;
  for (; kills < kills_; ++kills) {
    DaemonProcess daemon(daemons_.options);
    const auto client = connect(daemons_.options, 4000);
    const Json before = job(*client);
    if (before.at("state") == "done") break;
    ASSERT_EQ(before.at("state"), kills == 0 ? "ready" : "paused");
    const auto in_doubt = before.at("dots").at("in_doubt").get<std::size_t>();
    ASSERT_LE(in_doubt, doubts + 1) << "a kill leaves at most one in doubt";
    ASSERT_GE(before.at("dots").at("exposed").get<std::size_t>(), last_done);
    last_done = before.at("dots").at("exposed").get<std::size_t>();
    start(*client);
    // What a stop by the guard left in doubt is not the kill's.
    doubts = job(*client).at("dots").at("in_doubt").get<std::size_t>();
    std::this_thread::sleep_for(
        std::chrono::duration<double>(kill_after_max_s * static_cast<double>(random() % 1000) / 1000));
    daemon.end(SIGKILL);
  }
  EXPECT_GT(last_done, 0u);
  const DaemonProcess daemon(daemons_.options);
  const auto client = connect(daemons_.options, 4000);
  finish(*client);
  const Json after = job(*client);
  const auto in_doubt = after.at("in_doubt").get<std::set<std::size_t>>();
  EXPECT_EQ(after.at("dots").at("exposed").get<std::size_t>() + in_doubt.size(), dots_);

  const ExposureProgram program = read_program(daemons_.job_folder(id_) / "program.ply");
  const auto testimony = test::hear_witness(program, world_.emissions());
  EXPECT_EQ(testimony.in_motion, 0u);
  EXPECT_EQ(testimony.strays, 0u);
  EXPECT_EQ(testimony.too_long, 0u) << testimony.longest_overrun_s;
  for (std::size_t i = 0; i < dots_; ++i) {
    ASSERT_LE(testimony.light[i], 1) << "dot " << i << " was lit twice";
    ASSERT_TRUE(testimony.is_whole[i] || in_doubt.contains(i)) << "dot " << i << ": " << testimony.light[i];
  }
  std::printf("%d kills: %zu dots painted once, %zu in doubt\n", kills, dots_ - in_doubt.size(),
              in_doubt.size());
}

}  // namespace
}  // namespace hilbrush
