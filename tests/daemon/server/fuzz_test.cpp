#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <thread>

#include "config/rpc_errors.h"
#include "tests/daemon/server/daemon_fixture.h"

/// Requests made after the daemon's own schemas, right and wrong in every way that these allow, and damaged
/// in transit. rpc_fuzzer.cpp looks for what the schemas do not know.
namespace hilbrush {
namespace {

using test::DaemonWorld;
using test::Json;
using test::LineClient;

class RequestMaker {
 public:
  RequestMaker(Json discovered, unsigned seed) : discovered_(std::move(discovered)), random_(seed) {}

  Json request(int id) {
    Json request{{"jsonrpc", "2.0"}, {"id", id}};
    const Json& methods = discovered_.at("methods");
    const Json& method = methods[random_() % methods.size()];
    request["method"] = one_in(30) ? Json("no.such") : method.at("name");
    Json params = Json::object();
    for (const Json& param : method.at("params")) {
      const bool is_required = param.at("required").get<bool>();
      if (is_required ? !one_in(10) : one_in(2))
        params[param.at("name").get<std::string>()] = value(param.at("schema"));
    }
    if (one_in(20)) params["unknown"] = anything(3);
    if (!params.empty() || one_in(2)) request["params"] = std::move(params);
    if (one_in(40)) request["params"] = anything(3);
    return request;
  }

  std::string damaged(std::string text) {
    for (int i = 0; i < 3 && !text.empty(); ++i) {
      const auto place = random_() % text.size();
      switch (random_() % 4) {
        case 0:
          text[place] = static_cast<char>(random_());
          break;
        case 1:
          text.erase(place, 1 + random_() % 8);
          break;
        case 2:
          text.insert(place, text.substr(random_() % text.size(), random_() % 20));
          break;
        default:
          text.resize(place);
      }
    }
    for (char& c : text)
      if (c == '\n') c = ' ';
    return text;
  }
  bool one_in(unsigned n) { return random_() % n == 0; }

 private:
  Json value(const Json& schema) {
    if (one_in(8)) return anything(3);
    if (schema.contains("const")) return schema["const"];
    if (schema.contains("enum")) return schema["enum"][random_() % schema["enum"].size()];
    const Json type = schema.value("type", Json("string"));
    if (type == "string") {
      static const char* const kTexts[] = {"1",    "2",      "77",   "",          "/no/such.wrl",
                                           "/tmp", "secret", "\x01", "9999999999"};
      return kTexts[random_() % std::size(kTexts)];
    }
    if (type == "integer") return static_cast<std::int64_t>(random_() % 5);
    if (type == "boolean") return one_in(2);
    if (type == "object") return one_in(2) ? Json{{"size_mm", 80}} : anything(4);
    return anything(2);
  }

  Json anything(int depth) {
    switch (random_() % (depth > 0 ? 10 : 7)) {
      case 0:
        return nullptr;
      case 1:
        return one_in(2);
      case 2:
        return -1e300;
      case 3:
        return std::int64_t{-1} << 62;
      case 4:
        return ~std::uint64_t{0};
      case 5:
        return std::string(random_() % 3000, 'x');
      case 6:
        return "\xc3\x28 \xff";
      case 7:
        return Json::array({anything(depth - 1), anything(depth - 1)});
      default:
        return Json{{"id", anything(depth - 1)}, {"size_mm", anything(depth - 1)}};
    }
  }

  const Json discovered_;
  std::mt19937 random_;
};

TEST(ServerFuzzTest, EveryRequestGetsOneAnswerWhateverItAsks) {
  const bool is_long = std::getenv("HILBRUSH_LONG") != nullptr;
  const int count = is_long ? 1000000 : 6000;
  const unsigned seed = 17;
  SCOPED_TRACE(seed);
  DaemonWorld world;
  world.begin();
  auto client = std::make_unique<LineClient>(world.options.socket);
  RequestMaker maker(client->result("rpc.discover"), seed);
  for (int id = 1; id <= count; ++id) {
    const Json request = maker.request(id);
    std::string text = request.dump(-1, ' ', false, Json::error_handler_t::ignore);
    const bool is_damaged = maker.one_in(4);
    if (is_damaged) text = maker.damaged(text);
    client->send_bytes(text + "\n");
    if (is_damaged) {  // a notification or nothing may be left of it: ask something whose answer is known
      client->send_bytes("{\"jsonrpc\":\"2.0\",\"id\":\"sentinel\",\"method\":\"cell.status\"}\n");
    }
    bool is_closed = false;
    for (;;) {
      const auto line = client->read_line();
      if (!line) {  // a token that belongs to no user
        is_closed = true;
        break;
      }
      const Json answer = Json::parse(*line, nullptr, false);
      ASSERT_FALSE(answer.is_discarded()) << *line;
      if (is_damaged) {
        if (answer.is_object() && answer.contains("id") && answer["id"] == "sentinel") break;
        continue;
      }
      if (answer.contains("method")) continue;  // of a job that is watched
      ASSERT_EQ(answer.at("id"), id) << text;
      ASSERT_NE(answer.contains("result"), answer.contains("error")) << *line;
      is_closed = request.at("method") == "session.open" && answer.contains("error") &&
                  answer["error"]["code"] == kRpcNotPermitted;  // no user's token
      break;
    }
    if (is_closed) {
      EXPECT_TRUE(is_damaged || text.find("session.open") != std::string::npos) << text;
      client = std::make_unique<LineClient>(world.options.socket);
    }
  }
}

/// What rpc_fuzzer starts from, and whatever it has found: each file is one client's conversation.
TEST(ServerFuzzTest, TheCorpusIsAnsweredAndTheDaemonGoesOn) {
  DaemonWorld world;
  world.begin();
  std::size_t files = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::string(HILBRUSH_SOURCE_DIR) + "/tests/fuzz/corpus/rpc")) {
    SCOPED_TRACE(entry.path().string());
    std::ifstream in(entry.path(), std::ios::binary);
    LineClient client = world.client();
    client.send_bytes(std::string((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>()));
    client.end_sending();
    std::size_t answers = 0;
    while (const auto line = client.read_line()) {
      EXPECT_FALSE(Json::parse(*line, nullptr, false).is_discarded()) << *line;
      ++answers;
    }
    EXPECT_GT(answers, 0u);
    ++files;
  }
  EXPECT_GT(files, 5u);
  LineClient client = world.client();
  const auto laser = [&] { return client.result("cell.status").at("cell").at("laser").get<std::string>(); };
  // A stop whose client is gone may still be on its way to the laser.
  while (laser() == "unconfirmed") std::this_thread::yield();
  EXPECT_EQ(laser(), "off");
}

}  // namespace
}  // namespace hilbrush
