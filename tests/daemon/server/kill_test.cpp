#include <gtest/gtest.h>
#include <poll.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstring>
#include <map>
#include <random>
#include <set>

#include "planner/cell_model/program_file.h"
#include "sim/devices/emission_record.h"
#include "tests/daemon/execution/witnessed_cell.h"
#include "tests/daemon/server/daemon_fixture.h"
#include "tests/daemon/server/daemon_process.h"

namespace hilbrush {
namespace {

using test::connect;
using test::DaemonProcess;
using test::DaemonWorld;
using test::is_built;
using test::JointsKey;
using test::Json;
using test::key_of;
using test::LineClient;

/// By the witness: no dot twice, and each that is not in doubt once.
void expect_painted_once(const std::filesystem::path& folder, const Json& job) {
  const auto in_doubt = job.at("in_doubt").get<std::set<std::size_t>>();
  std::map<JointsKey, int> counts;
  for (const auto& emission : read_emission_record(folder / "emissions.ply")) {
    EXPECT_FALSE(emission.is_moving);
    ++counts[key_of(emission.joints)];
  }
  const auto program = read_program(folder / "program.ply");
  for (std::size_t i = 0; i < program.exposures.size(); ++i) {
    const int count = counts[key_of(program.exposures[i].joints)];
    EXPECT_LE(count, 1) << "dot " << i;
    EXPECT_TRUE(count == 1 || in_doubt.contains(i)) << "dot " << i << " was exposed " << count << " times";
  }
}

/// As when the terminal that it was started from is closed.
TEST(ServerKillTest, AHangUpEndsNothingAndFilesAreForOwnerAndGroupWhateverTheUmask) {
  if (!is_built()) GTEST_SKIP() << "hilbrushd is not built";
  DaemonWorld world;
  const mode_t before = ::umask(0);
  DaemonProcess daemon(world.options);
  ::umask(before);
  const auto client = connect(world.options);
  ASSERT_EQ(::kill(daemon.pid(), SIGHUP), 0);
  EXPECT_EQ(client->result("cell.status").at("cell").at("state"), "stopped");
  const std::string id = world.submit(*client, world.model("cup.wrl", 5), "done", true);
  using std::filesystem::perms;
  for (const auto& file : {world.options.state / "jobs.sqlite", world.options.state / "audit.log",
                           world.job_folder(id), world.job_folder(id) / "job.json"})
    EXPECT_EQ(std::filesystem::status(file).permissions() & (perms::others_all | perms::group_write),
              perms::none)
        << file;
  EXPECT_EQ(daemon.end(SIGTERM), 0);
}

TEST(ServerKillTest, AKilledDaemonLeavesAtMostOneDotInDoubtAndTheRestIsPaintedOnce) {
  if (!is_built()) GTEST_SKIP() << "hilbrushd is not built";
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
      expect_painted_once(world.job_folder(id), done);
      break;
    }
    while (client->result("job.get", {{"id", id}}).at("job").at("stage") != "paint")
      std::this_thread::yield();
    std::this_thread::sleep_for(std::chrono::milliseconds(20 + random() % 100));
    EXPECT_EQ(daemon.end(SIGKILL), -SIGKILL);
  }
}

/// SIGSTOP holds every thread; the clock and the cell go on. What it meets afterwards is as after any
/// silence.
TEST(ServerKillTest, AFrozenDaemonExposesNothingTwiceWhenItGoesOn) {
  if (!is_built()) GTEST_SKIP() << "hilbrushd is not built";
  DaemonWorld world;
  world.options.time_scale = 0.02;
  const unsigned seed = 8;
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  DaemonProcess daemon(world.options);
  const auto client = connect(world.options);
  const auto id = world.submit(*client, world.model("cup.wrl", 800), "ready");
  world.clear_and_arm(*client);
  client->result("job.start", {{"id", id}, {"part_in_place", true}});
  for (int round = 0; round < 12; ++round) {
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 60000));
    ::kill(daemon.pid(), SIGSTOP);
    std::this_thread::sleep_for(std::chrono::milliseconds(random() % 300));  // up to 15 s of the cell
    ::kill(daemon.pid(), SIGCONT);
    const Json job = client->result("job.get", {{"id", id}}).at("job");
    if (job.at("state") == "done") break;
    if (job.at("state") != "paused") continue;
    world.clear_and_arm(*client);
    client->result("job.resume", {{"id", id}, {"part_in_place", true}});
  }
  for (;;) {
    const Json job = client->result("job.get", {{"id", id}}).at("job");
    if (job.at("state") == "done") {
      expect_painted_once(world.job_folder(id), job);
      break;
    }
    if (job.at("state") == "paused") {
      world.clear_and_arm(*client);
      client->result("job.resume", {{"id", id}, {"part_in_place", true}});
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  EXPECT_EQ(daemon.end(SIGTERM), 0);
}

/// As a disk that fills up: no file may grow any more. The daemon lives, answers, stops the job, and goes on
/// when there is room again.
TEST(ServerKillTest, AFullDiskStopsTheJobAndNothingElse) {
  if (!is_built()) GTEST_SKIP() << "hilbrushd is not built";
  DaemonWorld world;
  world.options.time_scale = 0.02;
  DaemonProcess daemon(world.options);
  const auto client = connect(world.options);
  const auto id = world.submit(*client, world.model("cup.wrl", 600), "ready");
  world.clear_and_arm(*client);
  client->result("job.start", {{"id", id}, {"part_in_place", true}});
  while (client->result("job.get", {{"id", id}}).at("job").at("dots").at("exposed").get<int>() < 100)
    std::this_thread::yield();
  rlimit before{};
  ASSERT_EQ(::prlimit(daemon.pid(), RLIMIT_FSIZE, nullptr, &before), 0);
  rlimit full = before;
  full.rlim_cur = 1;
  ASSERT_EQ(::prlimit(daemon.pid(), RLIMIT_FSIZE, &full, nullptr), 0);
  const Json paused = world.wait_for(*client, id, "paused");
  EXPECT_FALSE(paused.at("error").is_null());
  EXPECT_EQ(client->result("cell.status").at("cell").at("laser"), "off");
  EXPECT_FALSE(client->result("system.info").at("system").at("store_fault").is_null());
  EXPECT_NE(client->error_code("job.submit",
                               {{"model", world.model("b.wrl").string()}, {"settings", {{"size_mm", 80}}}}),
            0);
  EXPECT_EQ(client->result("cell.stop").at("cell").at("state"), "stopped") << "whatever else fails";
  ASSERT_EQ(::prlimit(daemon.pid(), RLIMIT_FSIZE, &before, nullptr), 0);
  world.clear_and_arm(*client);
  client->result("job.resume", {{"id", id}, {"part_in_place", true}});
  const Json done = world.wait_for(*client, id, "done");
  EXPECT_LE(done.at("dots").at("in_doubt").get<int>(), 1);
  EXPECT_EQ(done.at("dots").at("in_doubt").get<int>() + done.at("dots").at("exposed").get<int>(), 600);
  expect_painted_once(world.job_folder(id), done);
  EXPECT_EQ(client->result("system.info").at("system").at("store_fault"), nullptr);
  EXPECT_EQ(daemon.end(SIGTERM), 0);
}

/// In place of systemd: the other end of its notification socket.
class NotifySocket {
 public:
  explicit NotifySocket(const std::filesystem::path& path)
      : fd_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
    EXPECT_EQ(::bind(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  }
  ~NotifySocket() { ::close(fd_); }
  NotifySocket(const NotifySocket&) = delete;
  NotifySocket& operator=(const NotifySocket&) = delete;
  /// The next message, or nothing within `patience`.
  std::string next(std::chrono::milliseconds patience) {
    pollfd polled{fd_, POLLIN, 0};
    if (::poll(&polled, 1, static_cast<int>(patience.count())) <= 0) return "";
    char text[1000];
    const ssize_t count = ::recv(fd_, text, sizeof text, 0);
    return {text, static_cast<std::size_t>(std::max<ssize_t>(count, 0))};
  }

 private:
  int fd_;
};

TEST(ServerKillTest, TellsSystemdThatItIsReadyAliveAndEnding) {
  if (!is_built()) GTEST_SKIP() << "hilbrushd is not built";
  DaemonWorld world;
  const auto path = world.folder() / "notify";
  NotifySocket systemd(path);
  DaemonProcess daemon(world.options, {"NOTIFY_SOCKET=" + path.string(), "WATCHDOG_USEC=400000"});
  using std::chrono::milliseconds;
  EXPECT_EQ(systemd.next(milliseconds(20000)), "READY=1");
  EXPECT_NO_THROW(world.client()) << "ready means that it answers";
  for (int i = 0; i < 3; ++i) EXPECT_EQ(systemd.next(milliseconds(5000)), "WATCHDOG=1");
  ::kill(daemon.pid(), SIGSTOP);
  while (!systemd.next(milliseconds(100)).empty()) {
  }
  EXPECT_EQ(systemd.next(milliseconds(500)), "") << "a frozen daemon feeds no watchdog";
  ::kill(daemon.pid(), SIGCONT);
  EXPECT_EQ(systemd.next(milliseconds(5000)), "WATCHDOG=1");
  ::kill(daemon.pid(), SIGTERM);
  std::string last;
  for (std::string message; message != "STOPPING=1" && !(message = systemd.next(milliseconds(5000))).empty();)
    last = message;
  EXPECT_EQ(last, "STOPPING=1");
  EXPECT_EQ(daemon.end(SIGTERM), 0);
}

}  // namespace
}  // namespace hilbrush
