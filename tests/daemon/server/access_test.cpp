#include "daemon/server/access.h"

#include <grp.h>
#include <gtest/gtest.h>
#include <pwd.h>
#include <unistd.h>

#include <fstream>
#include <iterator>

#include "config/rpc_errors.h"
#include "sampling/base/input_error.h"
#include "sampling/base/sha256.h"
#include "tests/daemon/server/daemon_fixture.h"

namespace hilbrush {
namespace {

using test::DaemonWorld;
using test::Json;
using test::LineClient;

constexpr uid_t kStranger = 54321;

std::string my_name() {
  return ::getpwuid(::geteuid())->pw_name;
}

DaemonSettings with_rules(std::vector<DaemonSettings::AccessRule> rules) {
  DaemonSettings settings;
  settings.access = std::move(rules);
  return settings;
}

TEST(AccessTest, WithoutRulesWhoeverOpensTheSocketMayOperate) {
  const Access access{DaemonSettings{}};
  const Peer peer = access.local_peer(kStranger, kStranger, 7, {});
  EXPECT_TRUE(peer.may_operate);
  EXPECT_TRUE(peer.may_look);
  EXPECT_EQ(peer.user, std::to_string(kStranger)) << "a user without a name";
}

TEST(AccessTest, WithRulesOnlyThoseNamedAndRootAndTheDaemonsOwnUserMay) {
  const Access access(with_rules({{"bin", "", true}, {"", "daemon", false}}));
  const auto bin = *::getpwnam("bin");
  EXPECT_TRUE(access.local_peer(bin.pw_uid, bin.pw_gid, 1, {}).may_operate);
  const gid_t group = ::getgrnam("daemon")->gr_gid;
  const Peer by_first_group = access.local_peer(kStranger, group, 1, {});
  EXPECT_TRUE(by_first_group.may_look);
  EXPECT_FALSE(by_first_group.may_operate);
  EXPECT_TRUE(access.local_peer(kStranger, kStranger, 1, {4, group, 9}).may_look) << "a further group";
  EXPECT_FALSE(access.local_peer(kStranger, kStranger, 1, {4, 9}).may_look);
  EXPECT_TRUE(access.local_peer(0, 0, 1, {}).may_operate);
  EXPECT_TRUE(access.local_peer(::geteuid(), ::getegid(), 1, {}).may_operate);
}

TEST(AccessTest, UnknownNamesAreRefusedWithTheirPlace) {
  try {
    const Access access(with_rules({{"root", "", true}, {"", "no such group", false}}));
    ADD_FAILURE() << "taken";
  } catch (const InputError& error) {
    EXPECT_EQ(error.at(), "$.access[1].group");
  }
}

TEST(AccessTest, ATokenIsAUser) {
  DaemonSettings settings = with_rules({{"bin", "", false}});
  settings.tcp = DaemonSettings::Tcp{"127.0.0.1", 0, {{"bin", sha256_hex("secret")}}};
  const Access access(settings);
  const auto peer = access.token_peer("secret", "10.0.0.1:99");
  ASSERT_TRUE(peer);
  EXPECT_EQ(peer->user, "bin");
  EXPECT_EQ(peer->address, "10.0.0.1:99");
  EXPECT_TRUE(peer->may_look);
  EXPECT_FALSE(peer->may_operate) << "the rules hold for tokens, too";
  EXPECT_FALSE(access.token_peer("Secret", ""));
  EXPECT_FALSE(access.token_peer("", ""));
}

TEST(ServerTcpTest, NothingListensUnlessConfigured) {
  DaemonWorld world;
  world.begin();
  LineClient client = world.client();
  EXPECT_EQ(client.result("system.info").at("system").at("tcp"), nullptr);
  EXPECT_EQ(world.daemon().tcp_address(), "");
}

TEST(ServerTcpTest, AConnectionSaysWhoItIsFirst) {
  DaemonWorld world;
  world.options.settings.tcp = DaemonSettings::Tcp{"127.0.0.1", 0, {{my_name(), sha256_hex("secret")}}};
  world.begin();
  for (const char* method : {"cell.stop", "job.list", "rpc.discover", "no.such.method"}) {
    const auto stranger = LineClient::over_tcp(world.daemon().tcp_address());
    EXPECT_NE(stranger->error_code(method), 0) << method;
    EXPECT_FALSE(stranger->read_line()) << "closed after its first message";
  }
  const auto client = LineClient::over_tcp(world.daemon().tcp_address());
  EXPECT_EQ(client->result("session.open", {{"token", "secret"}}).at("user"), my_name());
  EXPECT_TRUE(client->result("job.list").at("jobs").empty());
  EXPECT_EQ(client->result("cell.stop").at("cell").at("state"), "stopped");

  const auto liar = LineClient::over_tcp(world.daemon().tcp_address());
  EXPECT_EQ(liar->error_code("session.open", {{"token", "sesame"}}), kRpcNotPermitted);
  EXPECT_FALSE(liar->read_line()) << "and out";
  EXPECT_EQ(client->result("system.info").at("system").at("tcp"), world.daemon().tcp_address());
  client->end_sending();
  EXPECT_FALSE(client->read_line());

  std::ifstream in(world.options.state / "audit.log");
  const std::string log((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  EXPECT_EQ(log.find("secret"), std::string::npos) << "a token is never written down";
  EXPECT_EQ(log.find("sesame"), std::string::npos);
  EXPECT_NE(log.find("\"address\":\"127.0.0.1:"), std::string::npos);
  EXPECT_NE(log.find("refused"), std::string::npos);
}

std::string audit_log(const DaemonWorld& world) {
  std::ifstream in(world.options.state / "audit.log");
  return std::string((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
}

TEST(ServerTcpTest, StrangersFillNeitherTheLogNorTheRoomOfOthers) {
  DaemonWorld world;
  world.options.settings.tcp = DaemonSettings::Tcp{"127.0.0.1", 0, {{my_name(), sha256_hex("secret")}}};
  world.begin();
  const std::string address = world.daemon().tcp_address();
  std::vector<std::unique_ptr<LineClient>> idle;
  for (int i = 0; i < 100; ++i) idle.push_back(LineClient::over_tcp(address));
  std::string flood;
  for (int i = 0; i < 2000; ++i)
    flood += R"({"jsonrpc":"2.0","id":1,"method":"cell.stop"})"
             "\n";
  for (int i = 0; i < 20; ++i) {
    const auto stranger = LineClient::over_tcp(address);
    stranger->send_bytes(flood);
    const auto liar = LineClient::over_tcp(address);
    EXPECT_EQ(liar->error_code("session.open", {{"token", "sesame"}}), kRpcNotPermitted);
  }
  LineClient local = world.client();
  EXPECT_LT(local.result("system.info").at("system").at("clients"), 40) << "the oldest strangers were closed";
  const std::string log = audit_log(world);
  EXPECT_LT(log.size(), 1000u) << "refusals are counted";
  EXPECT_NE(log.find("\"uid\":null"), std::string::npos) << "a stranger is not root: " << log;
  const auto late = LineClient::over_tcp(address);
  EXPECT_EQ(late->error_code("session.open", {{"token", "secret"}}), kRpcNotPermitted)
      << "after twenty wrong tokens no further one from this address is tried";
  EXPECT_EQ(local.result("cell.stop").at("cell").at("state"), "stopped");
}

TEST(ServerTcpTest, AStrangersMessageIsShort) {
  DaemonWorld world;
  world.options.settings.tcp = DaemonSettings::Tcp{"127.0.0.1", 0, {{my_name(), sha256_hex("secret")}}};
  world.begin();
  const auto stranger = LineClient::over_tcp(world.daemon().tcp_address());
  stranger->send_bytes(std::string(10000, ' '));
  EXPECT_EQ(stranger->read_message().at("error").at("code"), kRpcParse);
  EXPECT_FALSE(stranger->read_line());
}

TEST(ServerTcpTest, ATakenPortIsASentence) {
  DaemonWorld first, second;
  first.options.settings.tcp = DaemonSettings::Tcp{"127.0.0.1", 0, {{my_name(), sha256_hex("secret")}}};
  first.begin();
  const std::string address = first.daemon().tcp_address();
  second.options.settings = first.options.settings;
  second.options.settings.tcp->port =
      static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1)));
  EXPECT_THROW(second.begin(), std::runtime_error);
}

/// Observers are found by their credentials; a token of a user who may only look stands for one here.
TEST(ServerTcpTest, WhoMayOnlyLookMayAlsoStop) {
  DaemonWorld world;
  world.options.settings = with_rules({{"bin", "", false}});
  world.options.settings.tcp = DaemonSettings::Tcp{"127.0.0.1", 0, {{"bin", sha256_hex("look")}}};
  world.begin();
  LineClient mine = world.client();
  const auto id = world.submit(mine, world.model("cup.wrl"), "ready");
  const auto client = LineClient::over_tcp(world.daemon().tcp_address());
  client->result("session.open", {{"token", "look"}});
  EXPECT_EQ(client->result("job.get", {{"id", id}}).at("job").at("state"), "ready");
  EXPECT_EQ(client->result("cell.status").at("cell").at("state"), "stopped");
  for (const char* method : {"cell.clear", "cell.arm", "cell.home"})
    EXPECT_EQ(client->error_code(method), kRpcNotPermitted) << method;
  EXPECT_EQ(client->error_code("job.start", {{"id", id}, {"part_in_place", true}}), kRpcNotPermitted);
  EXPECT_EQ(client->error_code("job.cancel", {{"id", id}}), kRpcNotPermitted);
  EXPECT_EQ(client->error_code("job.submit", {{"model", "/cup.wrl"}}), kRpcNotPermitted);
  world.clear_and_arm(mine);
  EXPECT_EQ(client->result("cell.stop").at("cell").at("state"), "stopped");
  EXPECT_EQ(mine.result("cell.status").at("cell").at("reason"), "stopped by bin");
}

}  // namespace
}  // namespace hilbrush
