#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <random>
#include <set>

#include "config/rpc_errors.h"
#include "tests/daemon/server/daemon_fixture.h"

namespace hilbrush {
namespace {

namespace fs = std::filesystem;
using test::DaemonWorld;
using test::Json;
using test::LineClient;

const std::string kStatus = R"({"jsonrpc":"2.0","id":1,"method":"cell.status"})";

TEST(ServerSocketTest, RefusesWhatIsNoRequestAndGoesOn) {
  DaemonWorld world;
  world.begin();
  LineClient client = world.client();
  const std::vector<std::pair<std::string, int>> cases{
      {"{", kRpcParse},
      {"\xff\xfe", kRpcParse},
      {R"({"jsonrpc":"2.0","id":1,"method":"cell.status)"
       "\xc3\x28\"}",
       kRpcParse},
      {std::string(100000, '['), kRpcParse},
      {R"({"a":1e999})", kRpcParse},
      {std::string("\0\0", 2), kRpcParse},
      {"[]", kRpcInvalidRequest},
      {"17", kRpcInvalidRequest},
      {R"({"id":1,"method":"cell.status"})", kRpcInvalidRequest},
      {R"({"jsonrpc":"1.0","id":1,"method":"cell.status"})", kRpcInvalidRequest},
      {R"({"jsonrpc":"2.0","id":{},"method":"cell.status"})", kRpcInvalidRequest},
      {R"({"jsonrpc":"2.0","id":1,"method":7})", kRpcInvalidRequest},
      {R"({"jsonrpc":"2.0","id":1,"method":"cell.explode"})", kRpcUnknownMethod},
      {R"({"jsonrpc":"2.0","id":1,"method":"cell.status","params":[1]})", kRpcBadParams},
      {R"({"jsonrpc":"2.0","id":1,"method":"cell.status","params":{"x":1}})", kRpcBadParams},
      {R"({"jsonrpc":"2.0","id":1,"method":"job.list","params":{"limit":0}})", kRpcBadParams},
      {R"({"jsonrpc":"2.0","id":1,"method":"job.get","params":{"id":null}})", kRpcBadParams}};
  for (const auto& [line, code] : cases) {
    client.send_bytes(line + "\n");
    const Json answer = client.read_message();
    ASSERT_TRUE(answer.contains("error")) << line.substr(0, 80) << " -> " << answer.dump();
    EXPECT_EQ(answer.at("error").at("code"), code) << line.substr(0, 80) << " -> " << answer.dump();
    EXPECT_FALSE(answer.at("error").at("message").get<std::string>().empty());
  }
  EXPECT_EQ(client.result("cell.status").at("cell").at("state"), "stopped");
}

TEST(ServerSocketTest, TakesHalfPipelinedAndEmptyMessages) {
  DaemonWorld world;
  world.begin();
  LineClient client = world.client();
  for (const char byte : kStatus + "\r\n") client.send_bytes(std::string(1, byte));
  EXPECT_EQ(client.read_message().at("id"), 1);
  std::string many = "\n  \n";
  for (int i = 0; i < 2000; ++i)
    many += R"({"jsonrpc":"2.0","method":"system.info","id":)" + std::to_string(i) + "}\n";
  std::thread sender([&] { client.send_bytes(many); });
  for (int i = 0; i < 2000; ++i) ASSERT_EQ(client.read_message().at("id"), i);
  sender.join();
}

TEST(ServerSocketTest, ServesBatchesAndNotifications) {
  DaemonWorld world;
  world.begin();
  LineClient client = world.client();
  client.send_bytes(
      "[" + kStatus +
      R"(,{"jsonrpc":"2.0","method":"cell.stop"},{"jsonrpc":"2.0","id":"b","method":"nothing"},5])" + "\n");
  const Json answers = client.read_message();
  ASSERT_EQ(answers.size(), 3u) << answers.dump();
  EXPECT_EQ(answers[0].at("result").at("cell").at("state"), "stopped");
  EXPECT_EQ(answers[1].at("error").at("code"), kRpcUnknownMethod);
  EXPECT_EQ(answers[2].at("error").at("code"), kRpcInvalidRequest);
  client.send_bytes(R"({"jsonrpc":"2.0","method":"cell.status"})"
                    "\n["
                    R"({"jsonrpc":"2.0","method":"cell.status"})"
                    "]\n");
  EXPECT_EQ(client.call("system.info").at("result").at("system").at("version"), HILBRUSH_VERSION)
      << "notifications get no answer";
  std::string large = "[" + kStatus;
  for (int i = 0; i < 200; ++i) large += "," + kStatus;
  client.send_bytes(large + "]\n");
  EXPECT_EQ(client.read_message().at("error").at("code"), kRpcInvalidRequest);
}

TEST(ServerSocketTest, AStopOvertakesWhatWaitsAndTheActsOfItsConnectionThatItOvertakesAreRefused) {
  DaemonWorld world;
  world.begin();
  LineClient client = world.client();
  client.result("cell.clear");
  std::string pipelined;
  for (int i = 0; i < 40; ++i)
    pipelined += R"({"jsonrpc":"2.0","id":"list","method":"rpc.discover"})"
                 "\n";
  pipelined += R"({"jsonrpc":"2.0","id":"arm","method":"cell.arm"})"
               "\n";
  pipelined += R"({"jsonrpc":"2.0","id":"stop","method":"cell.stop"})"
               "\n";
  client.send_bytes(pipelined);
  std::size_t lists_before_stop = 0;
  for (bool is_stopped = false, is_refused = false; !is_stopped || !is_refused;) {
    const Json answer = client.read_message();
    ASSERT_FALSE(answer.is_null());
    if (answer.at("id") == "list" && !is_stopped) ++lists_before_stop;
    if (answer.at("id") == "stop") is_stopped = answer.at("result").at("cell").at("state") == "stopped";
    if (answer.at("id") == "arm") is_refused = answer.at("error").at("code") == kRpcWrongState;
  }
  EXPECT_LT(lists_before_stop, 40u);
  EXPECT_EQ(client.result("cell.status").at("cell").at("state"), "stopped");
}

TEST(ServerSocketTest, AnObjectOfTooManyMembersIsRefusedBeforeItIsParsed) {
  DaemonWorld world;
  world.begin();
  LineClient client = world.client();
  std::string members;
  for (int i = 0; i < 80000; ++i) members += (i > 0 ? ",\"" : "\"") + std::to_string(i) + "\":1";
  const auto begin = std::chrono::steady_clock::now();
  client.send_bytes(R"({"jsonrpc":"2.0","id":1,"method":"job.submit","params":{)" + members + "}}\n");
  EXPECT_EQ(client.read_message().at("error").at("code"), kRpcParse);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(2));
}

TEST(ServerSocketTest, AHugeMessageIsRefusedAndItsConnectionClosed) {
  DaemonWorld world;
  world.begin();
  LineClient huge = world.client();
  LineClient other = world.client();
  std::thread sender([&] { huge.send_bytes(std::string((std::size_t{1} << 20) + 100000, 'x')); });
  EXPECT_EQ(huge.read_message().at("error").at("code"), kRpcParse);
  EXPECT_EQ(huge.read_line(), std::nullopt);
  sender.join();
  EXPECT_EQ(other.result("cell.status").at("cell").at("state"), "stopped");
}

TEST(ServerSocketTest, ManyIdleClientsAndOneThatNeverReadsDisturbNobody) {
  DaemonWorld world;
  world.options.time_scale = 0.02;
  world.begin();
  LineClient client = world.client();
  const auto id = world.submit(client, world.model("cup.wrl", 1500), "ready");

  std::vector<std::unique_ptr<LineClient>> idle;
  for (int i = 0; i < 250; ++i) idle.push_back(std::make_unique<LineClient>(world.options.socket));
  for (std::size_t i = 0; i < idle.size(); i += 2)
    idle[i]->send_bytes(kStatus.substr(0, i % kStatus.size()));  // half a message, for ever

  LineClient deaf = world.client();
  const std::string watch =
      R"({"jsonrpc":"2.0","id":1,"method":"job.watch","params":{"id":")" + id + "\"}}\n";
  const std::string discover = R"({"jsonrpc":"2.0","id":2,"method":"rpc.discover"})"
                               "\n";
  deaf.send_without_waiting(watch);
  std::size_t taken = 0;
  for (int i = 0; i < 100000; ++i) {
    const std::size_t count = deaf.send_without_waiting(discover);
    taken += count;
    if (count < discover.size()) break;
  }
  EXPECT_LT(taken, 10u << 20) << "the daemon reads on and on from a client that never reads";

  world.clear_and_arm(client);
  client.result("job.start", {{"id", id}, {"part_in_place", true}});
  std::chrono::steady_clock::duration worst{};
  for (int i = 0; i < 200; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    client.result("cell.status");
    worst = std::max(worst, std::chrono::steady_clock::now() - begin);
  }
  EXPECT_LT(worst, std::chrono::milliseconds(500));
  EXPECT_EQ(client.result("cell.stop").at("cell").at("laser"), "off");
  world.wait_for(client, id, "paused");
  world.clear_and_arm(client);
  client.result("job.resume", {{"id", id}, {"part_in_place", true}});
  world.wait_for(client, id, "done");
}

TEST(ServerSocketTest, ASlowWatcherGetsFewerUpdatesAndTheLastOne) {
  DaemonWorld world;
  world.begin();
  LineClient client = world.client();
  LineClient watcher = world.client();
  const auto id = world.submit(client, world.model("cup.wrl", 300), "ready");
  watcher.result("job.watch", {{"id", id}});
  world.clear_and_arm(client);
  client.result("job.start", {{"id", id}, {"part_in_place", true}});
  world.wait_for(client, id, "done");
  for (std::string state; state != "done";)
    state = watcher.next_update().at("job").at("state").get<std::string>();
  watcher.result("job.unwatch", {{"id", id}});
}

TEST(ServerSocketTest, AClientThatEndsItsSideStillGetsItsAnswers) {
  DaemonWorld world;
  world.begin();
  LineClient client = world.client();
  client.send_bytes(kStatus + "\n" + kStatus + "\n");
  client.end_sending();
  EXPECT_TRUE(client.read_message().contains("result"));
  EXPECT_TRUE(client.read_message().contains("result"));
  EXPECT_EQ(client.read_line(), std::nullopt);
}

TEST(ServerSocketTest, RandomBytesNeverEndTheDaemon) {
  DaemonWorld world;
  world.begin();
  const unsigned seed = 99;
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  for (int round = 0; round < 300; ++round) {
    LineClient client = world.client();
    std::string bytes =
        R"({"jsonrpc":"2.0","id":1,"method":"job.submit","params":{"model":"/x","settings":{"dpi":100,"size_mm":80}}})";
    for (int change = 0; change < 1 + static_cast<int>(random() % 6); ++change) {
      const std::size_t place = random() % bytes.size();
      switch (random() % 3) {
        case 0:
          bytes[place] = static_cast<char>(random());
          break;
        case 1:
          bytes.erase(place, random() % 8);
          break;
        default:
          bytes.insert(place, bytes.substr(random() % bytes.size(), random() % 20));
          break;
      }
      if (bytes.empty()) bytes = "{";
    }
    client.send_bytes(bytes + "\n");
    if (round % 3 != 0) continue;  // the others close without waiting
    client.end_sending();
    while (client.read_line()) {
    }
  }
  LineClient client = world.client();
  EXPECT_EQ(client.result("cell.status").at("cell").at("state"), "stopped");
}

TEST(ServerSocketTest, TheSocketIsForOwnerAndGroup) {
  DaemonWorld world;
  const mode_t before = ::umask(0);
  world.begin();
  ::umask(before);
  struct stat status {};
  ASSERT_EQ(::stat(world.options.socket.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777u, 0660u);
}

TEST(ServerSocketTest, ASecondDaemonIsRefusedAndAStaleSocketIsNot) {
  DaemonWorld world;
  world.begin();
  EXPECT_THROW(Daemon{world.options}, std::runtime_error) << "same state";
  DaemonOptions other = world.options;
  other.state = world.folder() / "other";
  EXPECT_THROW(Daemon{other}, std::runtime_error) << "same socket";
  LineClient client = world.client();
  EXPECT_EQ(client.result("cell.status").at("cell").at("state"), "stopped");
  world.end();
  EXPECT_FALSE(fs::exists(world.options.socket));

  { std::ofstream(world.options.socket) << "no socket"; }
  EXPECT_THROW(Daemon{world.options}, std::runtime_error) << "a file that is none of ours";
  EXPECT_TRUE(fs::exists(world.options.socket));
  fs::remove(world.options.socket);
}

TEST(ServerSocketTest, BadOptionsAreSentences) {
  DaemonWorld world;
  const auto sentence = [&](auto change) {
    DaemonOptions options = world.options;
    change(options);
    try {
      const Daemon daemon(options);
    } catch (const std::exception& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(sentence([](DaemonOptions& options) { options.cell = "no-such-cell"; }).find("no-such-cell"),
            std::string::npos);
  EXPECT_NE(sentence([](DaemonOptions& options) { options.time_scale = -1; }).find("--time-scale"),
            std::string::npos);
  EXPECT_FALSE(sentence([](DaemonOptions& options) { options.socket = "/nowhere/socket"; }).empty());
  EXPECT_NE(sentence([&](DaemonOptions& options) {
              options.socket = world.folder() / std::string(120, 's');
            }).find("too long"),
            std::string::npos);
}

TEST(ServerSocketTest, DiscoverListsExactlyWhatIsServed) {
  DaemonWorld world;
  world.begin();
  LineClient client = world.client();
  const Json document = client.result("rpc.discover");
  std::set<std::string> names;
  for (const auto& method : document.at("methods")) {
    const auto name = method.at("name").get<std::string>();
    names.insert(name);
    EXPECT_FALSE(method.at("summary").get<std::string>().empty());
    EXPECT_TRUE(method.at("result").at("schema").is_object()) << name;
    // An unknown parameter is refused by every method that is there, without doing anything.
    EXPECT_EQ(client.error_code(name, {{"no such parameter", 1}}), kRpcBadParams) << name;
    for (const auto& param : method.at("params")) EXPECT_TRUE(param.at("schema").is_object()) << name;
  }
  EXPECT_EQ(names, (std::set<std::string>{"job.submit", "job.list", "job.get", "job.start", "job.pause",
                                          "job.resume", "job.move", "job.cancel", "job.watch", "job.unwatch",
                                          "cell.status", "cell.stop", "cell.clear", "cell.arm", "cell.home",
                                          "system.info", "rpc.discover", "session.open"}));
}

TEST(ServerSocketTest, TheCellIsClearedArmedAndHomedInThreeActs) {
  DaemonWorld world;
  world.begin();
  LineClient client = world.client();
  EXPECT_EQ(client.error_code("cell.arm"), kRpcWrongState);
  EXPECT_EQ(client.error_code("cell.home"), kRpcWrongState);
  EXPECT_EQ(client.result("cell.clear").at("cell").at("state"), "idle");
  EXPECT_EQ(client.result("cell.clear").at("cell").at("state"), "idle") << "repeated, as for the next job";
  const Json homed = client.result("cell.home").at("cell");
  EXPECT_EQ(homed.at("state"), "idle");
  EXPECT_NEAR(homed.at("joints").at("j1_deg").get<double>(), 60, 1e-6);
  const Json armed = client.result("cell.arm").at("cell");
  EXPECT_EQ(armed.at("state"), "armed");
  EXPECT_EQ(armed.at("devices").at("laser").at("state"), "ready");
  EXPECT_EQ(client.result("cell.home").at("cell").at("state"), "armed");
  EXPECT_EQ(client.result("cell.clear").at("cell").at("state"), "armed") << "repeated";
  EXPECT_EQ(client.result("cell.arm").at("cell").at("state"), "armed") << "repeated";
  const Json stopped = client.result("cell.stop").at("cell");
  EXPECT_EQ(stopped.at("state"), "stopped");
  EXPECT_NE(stopped.at("devices").at("laser").at("state"), "ready");
}

TEST(ServerSocketTest, AStopOvertakesArmingWithItsStartDelay) {
  DaemonWorld world;
  world.options.time_scale = 1;  // five seconds of start delay
  world.begin();
  LineClient client = world.client();
  LineClient other = world.client();
  client.result("cell.clear");
  client.send_bytes(R"({"jsonrpc":"2.0","id":"arm","method":"cell.arm"})"
                    "\n");
  while (other.result("cell.status").at("cell").at("state") != "arming") std::this_thread::yield();
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(other.result("cell.stop").at("cell").at("state"), "stopped");
  const Json answer = client.read_message();
  EXPECT_EQ(answer.at("error").at("code"), kRpcWrongState) << answer.dump();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(3));
  EXPECT_NE(other.result("cell.status").at("cell").at("devices").at("laser").at("state"), "ready");
  EXPECT_EQ(other.result("cell.clear").at("cell").at("state"), "idle");
}

}  // namespace
}  // namespace hilbrush
