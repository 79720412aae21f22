#include "config/daemon_settings.h"

#include <algorithm>

#include "config/json_reader.h"

namespace hilbrush {
namespace {

constexpr std::size_t kRulesMax = 1000;
constexpr std::size_t kFileBytesMax = std::size_t{1} << 20;

DaemonSettings::AccessRule read_rule(JsonObject& json) {
  DaemonSettings::AccessRule rule;
  rule.user = json.optional_text("user").value_or("");
  rule.group = json.optional_text("group").value_or("");
  if (rule.user.empty() == rule.group.empty())
    json.refuse("user", "a rule is for a user or for a group: give one");
  rule.may_operate = json.choice("may", {"look", "operate"}) == 1;
  return rule;
}

DaemonSettings::Token read_token(JsonObject& json) {
  DaemonSettings::Token token{json.text("user"), json.text("sha256")};
  const auto is_digit = [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); };
  if (token.sha256.size() != 64 || !std::all_of(token.sha256.begin(), token.sha256.end(), is_digit))
    json.refuse("sha256", "expected 64 hexadecimal digits in lower case, as sha256sum prints them");
  return token;
}

DaemonSettings::Tcp read_tcp(JsonObject& json) {
  DaemonSettings::Tcp tcp;
  if (const auto host = json.optional_text("host")) tcp.host = *host;
  tcp.port = static_cast<std::uint16_t>(json.integer("port", 0, 65535));
  json.objects("tokens", kRulesMax, [&](JsonObject& token) { tcp.tokens.push_back(read_token(token)); });
  if (tcp.tokens.empty()) json.refuse("tokens", "is empty: without a token no client could connect over TCP");
  return tcp;
}

}  // namespace

DaemonSettings daemon_settings_from_json(const std::string& text, const std::string& origin) {
  DaemonSettings settings;
  read_json_object(text, origin, [&](JsonObject& json) {
    if (json.has("access")) {
      settings.access.emplace();
      json.objects("access", kRulesMax,
                   [&](JsonObject& rule) { settings.access->push_back(read_rule(rule)); });
    }
    if (json.has("tcp")) json.object("tcp", [&](JsonObject& tcp) { settings.tcp = read_tcp(tcp); });
  });
  return settings;
}

DaemonSettings load_daemon_settings(const std::filesystem::path& file) {
  return daemon_settings_from_json(read_text_file(file.string(), kFileBytesMax), file.string());
}

}  // namespace hilbrush
