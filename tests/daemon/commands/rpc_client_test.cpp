#include "daemon/commands/rpc_client.h"

#include <gtest/gtest.h>

#include <future>

#include "config/rpc_errors.h"
#include "tests/daemon/commands/command_runs.h"

namespace hilbrush {
namespace {

using commands_test::FakeDaemon;
using commands_test::Peer;
using Json = nlohmann::ordered_json;
using Milliseconds = RpcClient::Milliseconds;

/// What connection error a call of "m" ends with, against this script; empty: none.
std::string connection_error(const std::function<void(Peer&)>& script,
                             Milliseconds timeout = Milliseconds(5000)) {
  FakeDaemon daemon(script);
  try {
    RpcClient client(daemon.socket_path(), timeout);
    client.call("m", Json());
  } catch (const ConnectionError& error) {
    return error.what();
  }
  return {};
}

TEST(RpcClient, CallsAndGetsTheResult) {
  std::string request;
  FakeDaemon daemon([&](Peer& peer) {
    request = peer.read_line();
    peer.write_line(R"({"jsonrpc":"2.0","id":1,"result":{"b":1,"a":2}})");
    peer.wait_for_close();
  });
  RpcClient client(daemon.socket_path());
  EXPECT_EQ(client.call("job.get", Json{{"id", "7"}}).dump(), R"({"b":1,"a":2})");
  EXPECT_EQ(request, R"({"jsonrpc":"2.0","id":1,"method":"job.get","params":{"id":"7"}})");
}

TEST(RpcClient, PutsTogetherHalfMessagesAndTakesApartDoubleOnes) {
  FakeDaemon daemon([](Peer& peer) {
    peer.read_line();
    peer.write(R"({"jsonrpc":"2.0","method":"job.update","params":{"seq":1}})"
               "\n"
               R"({"jsonrpc":"2.)");
    std::this_thread::yield();
    peer.write(R"(0","id":1,"result":5})"
               "\n"
               R"({"jsonrpc":"2.0","method":"job.update","params":{"seq":2}})"
               "\n"
               "{\"jsonrpc\"");
    peer.read_line();
    peer.write(R"(:"2.0","id":2,"result":6})"
               "\n");
    peer.wait_for_close();
  });
  RpcClient client(daemon.socket_path());
  EXPECT_EQ(client.call("m", Json()), 5);
  EXPECT_EQ(client.call("m", Json()), 6);
  EXPECT_EQ(client.next_notification(Milliseconds(0))->params["seq"], 1);
  EXPECT_EQ(client.next_notification(Milliseconds(0))->params["seq"], 2);
  EXPECT_FALSE(client.next_notification(Milliseconds(0)).has_value());
}

TEST(RpcClient, RefusalsKeepCodeSentenceAndPlace) {
  FakeDaemon daemon([](Peer& peer) {
    peer.read_line();
    peer.write_line(
        R"({"jsonrpc":"2.0","id":1,"error":{"code":-32003,"message":"no geometry","data":{"at":"cup.wrl:12"}}})");
    peer.read_line();
    peer.write_line(R"({"jsonrpc":"2.0","id":null,"error":{"code":-32700,"message":"not JSON"}})");
    peer.wait_for_close();
  });
  RpcClient client(daemon.socket_path());
  try {
    client.call("m", Json());
    ADD_FAILURE() << "no refusal";
  } catch (const RpcRefusal& refusal) {
    EXPECT_EQ(refusal.code(), kRpcBadInput);
    EXPECT_STREQ(refusal.what(), "no geometry");
    EXPECT_EQ(refusal.at(), "cup.wrl:12");
  }
  try {
    client.call("m", Json());
    ADD_FAILURE() << "no refusal";
  } catch (const RpcRefusal& refusal) {
    EXPECT_EQ(refusal.code(), kRpcParse);
    EXPECT_EQ(refusal.at(), "");
  }
}

TEST(RpcClient, NoDaemonIsSaidInASentence) {
  const commands_test::TemporaryFolder folder;
  const std::string path = (folder.path() / "none.sock").string();
  try {
    const RpcClient client(path);
    ADD_FAILURE() << "connected";
  } catch (const ConnectionError& error) {
    EXPECT_EQ(error.what(), "no daemon answers on " + path + ": is hilbrushd running?");
  }
  EXPECT_THROW(RpcClient(std::string(200, 'x')), ConnectionError);
  EXPECT_THROW(RpcClient(""), ConnectionError);
  EXPECT_THROW(RpcClient(folder.write("file", "not a socket")), ConnectionError);
}

TEST(RpcClient, EarlyCloseIsALostConnection) {
  EXPECT_EQ(connection_error([](Peer&) {}), "the daemon closed the connection");
  EXPECT_EQ(connection_error([](Peer& peer) { peer.read_line(); }), "the daemon closed the connection");
  EXPECT_EQ(connection_error([](Peer& peer) {
              peer.read_line();
              peer.write("{\"jsonrpc\":\"2.0\",\"id\":1,\"resu");
            }),
            "the daemon closed the connection in the middle of a message");
}

TEST(RpcClient, SilenceEndsAtTheTimeLimit) {
  const auto start = std::chrono::steady_clock::now();
  const std::string error = connection_error([](Peer& peer) { peer.wait_for_close(); }, Milliseconds(60));
  EXPECT_TRUE(error.ends_with("did not answer m in 60 ms")) << error;
  const auto took = std::chrono::steady_clock::now() - start;
  EXPECT_GE(took, Milliseconds(60));
  EXPECT_LT(took, Milliseconds(4000));
}

TEST(RpcClient, HalfAMessageAndThenSilenceEndsToo) {
  const std::string error = connection_error(
      [](Peer& peer) {
        peer.write("{\"jsonrpc\":");
        peer.wait_for_close();
      },
      Milliseconds(60));
  EXPECT_TRUE(error.ends_with("did not answer m in 60 ms")) << error;
}

TEST(RpcClient, ADaemonThatDoesNotListenIsNotWaitedForForever) {
  // The request is larger than the socket's buffers, and the other end does not read.
  std::promise<void> done;
  FakeDaemon daemon([&](Peer&) { done.get_future().wait(); });
  RpcClient client(daemon.socket_path(), Milliseconds(100));
  EXPECT_THROW(client.call("m", Json{{"text", std::string(8 << 20, 'x')}}), ConnectionError);
  done.set_value();
}

TEST(RpcClient, AnswersThatAreNoJsonRpcAreRefused) {
  const auto answer = [](const std::string& line) {
    return connection_error([line](Peer& peer) {
      peer.read_line();
      peer.write_line(line);
      peer.wait_for_close();
    });
  };
  for (const char* line :
       {"HTTP/1.1 400 Bad Request", "[]", "{}", "", "{\"jsonrpc\":\"1.0\",\"id\":1,\"result\":1}", "\xff"})
    EXPECT_NE(answer(line).find("does not speak JSON-RPC 2.0"), std::string::npos)
        << line << ": " << answer(line);
  EXPECT_EQ(answer(R"({"jsonrpc":"2.0","id":2,"result":1})"),
            "the daemon answered a request that was not made");
  EXPECT_EQ(answer(R"({"jsonrpc":"2.0","id":1})"), "the daemon's answer has neither result nor error");
  EXPECT_EQ(answer(R"({"jsonrpc":"2.0","id":1,"error":"bad"})"),
            "the daemon answered with an error that is not a JSON-RPC error");
}

TEST(RpcClient, KeepsABoundedNumberOfNotifications) {
  const std::size_t sent = RpcClient::kNotificationsMax + 10;
  FakeDaemon daemon([&](Peer& peer) {
    peer.read_line();
    for (std::size_t i = 0; i < sent; ++i)
      peer.write_line(R"({"jsonrpc":"2.0","method":"u","params":)"
                      "[" +
                      std::to_string(i) + "]}");
    peer.write_line(R"({"jsonrpc":"2.0","id":1,"result":true})");
    peer.wait_for_close();
  });
  RpcClient client(daemon.socket_path());
  EXPECT_EQ(client.call("m", Json()), true);
  EXPECT_EQ(client.next_notification(Milliseconds(0))->params[0], 10);  // the oldest ten are gone
  std::size_t count = 1;
  while (client.next_notification(Milliseconds(0))) ++count;
  EXPECT_EQ(count, RpcClient::kNotificationsMax);
}

TEST(RpcClient, NotificationsAreWaitedForUpToTheLimit) {
  FakeDaemon daemon([](Peer& peer) {
    peer.write_line(R"({"jsonrpc":"2.0","method":"job.update","params":{"seq":3}})");
    peer.wait_for_close();
  });
  RpcClient client(daemon.socket_path());
  EXPECT_EQ(client.next_notification(Milliseconds(5000))->method, "job.update");
  EXPECT_FALSE(client.next_notification(Milliseconds(20)).has_value());
}

}  // namespace
}  // namespace hilbrush
