#include "config/daemon_settings.h"

#include <gtest/gtest.h>

#include "sampling/base/input_error.h"

namespace hilbrush {
namespace {

const std::string kDigest(64, 'a');

std::string refusal(const std::string& text) {
  try {
    daemon_settings_from_json(text, "daemon.json");
    return "";
  } catch (const InputError& error) {
    return error.at();
  }
}

TEST(DaemonSettingsTest, NothingIsTheDefault) {
  const DaemonSettings settings = daemon_settings_from_json("{}", "");
  EXPECT_FALSE(settings.access);
  EXPECT_FALSE(settings.tcp);
}

TEST(DaemonSettingsTest, ReadsRulesAndTcp) {
  const DaemonSettings settings = daemon_settings_from_json(
      R"({"access": [{"user": "anna", "may": "operate"}, {"group": "staff", "may": "look"}],
          "tcp": {"port": 4777, "tokens": [{"user": "anna", "sha256": ")" +
          kDigest + R"("}]}})",
      "");
  ASSERT_TRUE(settings.access && settings.tcp);
  ASSERT_EQ(settings.access->size(), 2u);
  EXPECT_EQ((*settings.access)[0].user, "anna");
  EXPECT_TRUE((*settings.access)[0].may_operate);
  EXPECT_EQ((*settings.access)[1].group, "staff");
  EXPECT_FALSE((*settings.access)[1].may_operate);
  EXPECT_EQ(settings.tcp->host, "127.0.0.1") << "this machine only, unless another address is named";
  EXPECT_EQ(settings.tcp->port, 4777);
  ASSERT_EQ(settings.tcp->tokens.size(), 1u);
  EXPECT_EQ(settings.tcp->tokens[0].sha256, kDigest);
}

TEST(DaemonSettingsTest, RefusesWithTheJsonPath) {
  EXPECT_EQ(refusal(R"({"acess": []})"), "daemon.json: $.acess");
  EXPECT_EQ(refusal(R"({"access": [{"user": "anna", "group": "staff", "may": "look"}]})"),
            "daemon.json: $.access[0].user");
  EXPECT_EQ(refusal(R"({"access": [{"may": "look"}]})"), "daemon.json: $.access[0].user");
  EXPECT_EQ(refusal(R"({"access": [{"user": "anna", "may": "dance"}]})"), "daemon.json: $.access[0].may");
  EXPECT_EQ(refusal(R"({"tcp": {"port": 70000, "tokens": []}})"), "daemon.json: $.tcp.port");
  EXPECT_EQ(refusal(R"({"tcp": {"port": 1, "tokens": []}})"), "daemon.json: $.tcp.tokens")
      << "a door without a key";
  EXPECT_EQ(refusal(R"({"tcp": {"port": 1, "tokens": [{"user": "anna", "sha256": "secret"}]}})"),
            "daemon.json: $.tcp.tokens[0].sha256");
}

}  // namespace
}  // namespace hilbrush
