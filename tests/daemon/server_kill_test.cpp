#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <map>
#include <random>
#include <set>

#include "planner/program_file.h"
#include "sim/devices/emission_record.h"
#include "tests/daemon/daemon_fixture.h"

extern char** environ;

namespace hilbrush {
namespace {

using test::DaemonWorld;
using test::Json;
using test::LineClient;

/// The program hilbrushd in a process of its own, which can be killed as no daemon in this process could.
class DaemonProcess {
 public:
  explicit DaemonProcess(const DaemonOptions& options) {
    const std::string program = std::string(HILBRUSH_BUILD_DIR) + "/hilbrushd";
    std::vector<std::string> arguments{program,
                                       "--socket",
                                       options.socket.string(),
                                       "--state",
                                       options.state.string(),
                                       "--cell",
                                       options.cell,
                                       "--time-scale",
                                       std::to_string(*options.time_scale),
                                       "--pipeline",
                                       options.pipeline.string(),
                                       "--log-level",
                                       "off"};
    std::vector<char*> argv;
    for (auto& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    EXPECT_EQ(::posix_spawn(&pid_, program.c_str(), nullptr, nullptr, argv.data(), environ), 0);
  }
  ~DaemonProcess() { end(SIGKILL); }
  DaemonProcess(const DaemonProcess&) = delete;
  DaemonProcess& operator=(const DaemonProcess&) = delete;

  /// The exit code, or minus the signal's number.
  int end(int signal) {
    if (pid_ <= 0) return 0;
    ::kill(pid_, signal);
    int status = 0;
    ::waitpid(std::exchange(pid_, -1), &status, 0);
    return WIFSIGNALED(status) ? -WTERMSIG(status) : WEXITSTATUS(status);
  }

 private:
  pid_t pid_ = -1;
};

std::unique_ptr<LineClient> connect(const DaemonOptions& options) {
  for (int attempt = 0; attempt < 2000; ++attempt) {
    try {
      return std::make_unique<LineClient>(options.socket);
    } catch (const std::runtime_error&) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }
  throw std::runtime_error("hilbrushd does not come up");
}

std::string key_of(const Joints& joints) {
  std::string key;
  for (const double value : joints) key += std::to_string(std::llround(value * 1e10)) + " ";
  return key;
}

TEST(ServerKillTest, AKilledDaemonLeavesAtMostOneDotInDoubtAndTheRestIsPaintedOnce) {
  if (::access((std::string(HILBRUSH_BUILD_DIR) + "/hilbrushd").c_str(), X_OK) != 0)
    GTEST_SKIP() << "hilbrushd is not built";
  DaemonWorld world;
  world.options.time_scale = 0.02;
  const unsigned seed = 5;
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  std::string id;
  {
    DaemonProcess daemon(world.options);
    const auto client = connect(world.options);
    id = world.submit(*client, world.model("cup.wrl", 800), "ready");
    EXPECT_EQ(daemon.end(SIGTERM), 0);
  }
  constexpr int kKills = 3;
  for (int round = 0; round <= kKills; ++round) {
    DaemonProcess daemon(world.options);
    const auto client = connect(world.options);
    const Json job = client->result("job.get", {{"id", id}}).at("job");
    EXPECT_EQ(job.at("state"), round == 0 ? "ready" : "paused");
    world.clear_and_arm(*client);
    client->result(round == 0 ? "job.start" : "job.resume", {{"id", id}, {"part_in_place", true}});
    if (round == kKills) {
      const Json done = world.wait_for(*client, id, "done");
      EXPECT_LE(done.at("dots").at("in_doubt").get<int>(), kKills);
      EXPECT_EQ(done.at("dots").at("in_doubt").get<int>() + done.at("dots").at("exposed").get<int>(), 800);
      const auto in_doubt = done.at("in_doubt").get<std::set<std::size_t>>();
      const auto folder = world.job_folder(id);
      std::map<std::string, int> counts;
      for (const auto& emission : read_emission_record(folder / "emissions.ply")) ++counts[key_of(emission.joints)];
      const auto program = read_program(folder / "program.ply");
      for (std::size_t i = 0; i < program.exposures.size(); ++i) {
        const int count = counts[key_of(program.exposures[i].joints)];
        EXPECT_LE(count, 1) << "dot " << i;
        EXPECT_TRUE(count == 1 || in_doubt.contains(i)) << "dot " << i << " was exposed " << count << " times";
      }
      break;
    }
    while (client->result("job.get", {{"id", id}}).at("job").at("stage") != "paint") std::this_thread::yield();
    std::this_thread::sleep_for(std::chrono::milliseconds(20 + random() % 100));
    EXPECT_EQ(daemon.end(SIGKILL), -SIGKILL);
  }
}

}  // namespace
}  // namespace hilbrush
