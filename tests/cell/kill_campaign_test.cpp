#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <random>
#include <set>
#include <thread>

#include "planner/program_file.h"
#include "tests/cell/wired_world.h"
#include "tests/cell/witness.h"
#include "tests/daemon/daemon_fixture.h"

extern char** environ;

/// hilbrushd killed with SIGKILL at random moments of a job over the wire, begun again, and the job resumed: by the
/// emissions' record no dot is lit twice, none is lost, and each kill leaves at most one in doubt. HILBRUSH_LONG: 200
/// kills of a job in real time.
namespace hilbrush {
namespace {

using test::DaemonWorld;
using test::Json;
using test::LineClient;

class KilledDaemon {
 public:
  explicit KilledDaemon(const DaemonOptions& options) {
    std::vector<std::string> arguments{std::string(HILBRUSH_BUILD_DIR) + "/hilbrushd",
                                       "--socket",
                                       options.socket.string(),
                                       "--state",
                                       options.state.string(),
                                       "--cell",
                                       options.cell,
                                       "--pipeline",
                                       options.pipeline.string(),
                                       "--log-level",
                                       "off"};
    std::vector<char*> argv;
    for (auto& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    EXPECT_EQ(::posix_spawn(&pid_, argv[0], nullptr, nullptr, argv.data(), environ), 0);
  }
  ~KilledDaemon() { kill(); }
  KilledDaemon(const KilledDaemon&) = delete;
  KilledDaemon& operator=(const KilledDaemon&) = delete;
  void kill() {
    if (pid_ <= 0) return;
    ::kill(pid_, SIGKILL);
    ::waitpid(std::exchange(pid_, -1), nullptr, 0);
  }

 private:
  pid_t pid_ = -1;
};

class KillCampaign : public testing::Test {
 protected:
  static bool is_long() { return std::getenv("HILBRUSH_LONG") != nullptr; }

  std::unique_ptr<LineClient> connect() {
    for (int attempt = 0; attempt < 4000; ++attempt) {
      try {
        return std::make_unique<LineClient>(daemons_.options.socket);
      } catch (const std::runtime_error&) {
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
    }
    throw std::runtime_error("hilbrushd does not come up");
  }
  std::size_t done(LineClient& client) {
    const Json dots = client.result("job.get", {{"id", id_}}).at("job").at("dots");
    return dots.at("exposed").get<std::size_t>();
  }
  void start(LineClient& client, bool is_first) {
    daemons_.clear_and_arm(client);
    client.result(is_first ? "job.start" : "job.resume", {{"id", id_}, {"part_in_place", true}});
    while (client.result("job.get", {{"id", id_}}).at("job").at("stage") != "paint") std::this_thread::yield();
  }

  const double time_scale_ = is_long() ? 1 : .05;
  const int kills_ = is_long() ? 200 : 8;
  const std::size_t dots_ = is_long() ? 4000 : 600;
  test::WiredWorld world_{test::WiredWorld::quick(time_scale_), test::WiredWorld::Drivers::kNone};
  DaemonWorld daemons_;
  std::string id_;
};

TEST_F(KillCampaign, NoDotTwiceNoneLostAtMostOneInDoubtEach) {
  if (::access((std::string(HILBRUSH_BUILD_DIR) + "/hilbrushd").c_str(), X_OK) != 0)
    GTEST_SKIP() << "hilbrushd is not built";
  const unsigned seed = 20261;
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  daemons_.options.cell = world_.cell_file().string();
  {
    KilledDaemon daemon(daemons_.options);
    const auto client = connect();
    id_ = daemons_.submit(*client, daemons_.model("cup.wrl", dots_), "ready");
  }
  const double kill_after_max_s = is_long() ? 1 : .06;
  std::size_t last_done = 0;
  int kills = 0;
  for (; kills < kills_; ++kills) {
    KilledDaemon daemon(daemons_.options);
    const auto client = connect();
    const Json job = client->result("job.get", {{"id", id_}}).at("job");
    if (job.at("state") == "done") break;
    ASSERT_EQ(job.at("state"), kills == 0 ? "ready" : "paused");
    ASSERT_LE(job.at("dots").at("in_doubt").get<int>(), kills) << "at most one in doubt each";
    ASSERT_GE(done(*client), last_done);
    last_done = done(*client);
    start(*client, kills == 0);
    std::this_thread::sleep_for(std::chrono::duration<double>(kill_after_max_s * (random() % 1000) / 1000.));
    daemon.kill();
  }
  EXPECT_GT(last_done, 0u);
  KilledDaemon daemon(daemons_.options);
  const auto client = connect();
  if (client->result("job.get", {{"id", id_}}).at("job").at("state") != "done") start(*client, false);
  const Json job = daemons_.wait_for(*client, id_, "done");
  const auto in_doubt = job.at("in_doubt").get<std::set<std::size_t>>();
  EXPECT_LE(in_doubt.size(), static_cast<std::size_t>(kills));
  EXPECT_EQ(job.at("dots").at("exposed").get<std::size_t>() + in_doubt.size(), dots_);

  const ExposureProgram program = read_program(daemons_.job_folder(id_) / "program.ply");
  const auto testimony = test::hear_witness(program, world_.emissions());
  EXPECT_EQ(testimony.in_motion, 0u);
  EXPECT_EQ(testimony.strays, 0u);
  EXPECT_EQ(testimony.too_long, 0u) << testimony.longest_overrun_s;
  for (std::size_t i = 0; i < dots_; ++i) {
    ASSERT_LE(testimony.light[i], 1) << "dot " << i << " was lit twice";
    ASSERT_TRUE(testimony.is_whole[i] || in_doubt.contains(i)) << "dot " << i << ": " << testimony.light[i];
  }
  std::printf("%d kills: %zu dots painted once, %zu in doubt\n", kills, dots_ - in_doubt.size(), in_doubt.size());
}

}  // namespace
}  // namespace hilbrush
