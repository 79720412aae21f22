#include "drivers/guard/guard_codec.h"

#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include "drivers/number_text.h"

namespace hilbrush::guard {
namespace {

constexpr std::array<std::pair<const char*, Verb>, 12> kVerbs{{{"connect", Verb::kConnect},
                                                               {"identify", Verb::kIdentify},
                                                               {"powers", Verb::kPowers},
                                                               {"arm", Verb::kArm},
                                                               {"disarm", Verb::kDisarm},
                                                               {"power", Verb::kPower},
                                                               {"request-status", Verb::kRequestStatus},
                                                               {"clear", Verb::kClear},
                                                               {"pulse", Verb::kPulse},
                                                               {"gate-off", Verb::kGateOff},
                                                               {"light", Verb::kLight},
                                                               {"dark", Verb::kDark}}};

bool has_value(Verb verb) {
  return verb == Verb::kPower || verb == Verb::kPulse || verb == Verb::kLight;
}

/// Cuts the first word off.
std::string_view take_word(std::string_view& text) {
  const std::size_t blank = text.find(' ');
  const std::string_view word = text.substr(0, blank);
  text.remove_prefix(blank == std::string_view::npos ? text.size() : blank + 1);
  return word;
}

template <class Number>
bool read(std::string_view word, Number& value) {
  const auto [rest, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error == std::errc() && rest == word.data() + word.size() && !word.empty();
}

}  // namespace

std::string encode(const Request& request) {
  const char* name = "";
  for (const auto& [word, verb] : kVerbs)
    if (verb == request.verb) name = word;
  const std::string text = std::to_string(request.number) + ' ' + name;
  return has_value(request.verb) ? text + ' ' + exact_text(request.value) : text;
}

std::optional<Request> decode_request(std::string_view message) {
  Request request;
  if (message.size() > kMessageMax || !read(take_word(message), request.number)) return std::nullopt;
  const std::string_view name = take_word(message);
  for (const auto& [word, verb] : kVerbs) {
    if (name != word) continue;
    request.verb = verb;
    if (!has_value(verb)) return message.empty() ? std::optional(request) : std::nullopt;
    if (!read(message, request.value) || !std::isfinite(request.value)) return std::nullopt;
    return request;
  }
  return std::nullopt;
}

std::string encode(const Reply& reply) {
  std::string message = std::to_string(reply.number) + (reply.is_ok ? " ok " : " error ") + reply.text;
  message.resize(std::min(message.size(), kMessageMax));
  return message;
}

std::optional<Reply> decode_reply(std::string_view message) {
  Reply reply;
  if (message.size() > kMessageMax || !read(take_word(message), reply.number)) return std::nullopt;
  const std::string_view word = take_word(message);
  if (word != "ok" && word != "error") return std::nullopt;
  reply.is_ok = word == "ok";
  reply.text = message;
  return reply;
}

std::string encode(const StatusMessage& message) {
  const std::string text = "status " + std::to_string(static_cast<int>(message.status.state)) +
                           (message.status.interlock_closed ? " 1" : " 0") +
                           (message.is_gate_on ? " 1 " : " 0 ") + std::to_string(message.read_ns) + ' ' +
                           std::to_string(message.requested_readings) + ' ';
  return (text + message.status.fault).substr(0, kMessageMax);
}

std::optional<StatusMessage> decode_status(std::string_view message) {
  if (message.size() > kMessageMax || take_word(message) != "status") return std::nullopt;
  StatusMessage result;
  int state = 0;
  int is_closed = 0;
  int is_gate_on = 0;
  if (!read(take_word(message), state) || !read(take_word(message), is_closed) ||
      !read(take_word(message), is_gate_on) || !read(take_word(message), result.read_ns) ||
      !read(take_word(message), result.requested_readings))
    return std::nullopt;
  if (state < 0 || state > static_cast<int>(DeviceState::kFault) || (is_closed & ~1) != 0 ||
      (is_gate_on & ~1) != 0)
    return std::nullopt;
  result.status.state = static_cast<DeviceState>(state);
  result.status.interlock_closed = is_closed == 1;
  result.is_gate_on = is_gate_on == 1;
  result.status.fault = message;
  return result;
}

}  // namespace hilbrush::guard
