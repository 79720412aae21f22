#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "drivers/laser_head.h"

/// What a laser's user and its guard say to each other over a socketpair that keeps messages apart
/// (SOCK_SEQPACKET). Text, so that a trace can be read: `17 power 0.0123`, `17 ok`, `17 error SENTENCE`,
/// `beat`, `status ...`. Pure functions; anything else decodes to nothing.
namespace hilbrush::guard {

inline constexpr std::size_t kMessageMax = 4096;

/// kLight: a gate that is not the laser's own opens, and will be reported closed by kDark within `value`
/// seconds. These two and kRequestStatus get no reply.
enum class Verb {
  kConnect,
  kIdentify,
  kPowers,
  kArm,
  kDisarm,
  kPower,
  kRequestStatus,
  kClear,
  kPulse,
  kGateOff,
  kLight,
  kDark
};

struct Request {
  std::uint32_t number = 0;
  Verb verb = Verb::kRequestStatus;
  double value = 0;  ///< W of kPower, s of kPulse and kLight
};
std::string encode(const Request& request);
std::optional<Request> decode_request(std::string_view message);

inline constexpr std::string_view kBeat = "beat";

struct Reply {
  std::uint32_t number = 0;
  bool is_ok = false;
  std::string text;  ///< an answer, or what went wrong
};
std::string encode(const Reply& reply);
std::optional<Reply> decode_reply(std::string_view message);

/// Sent whenever it changes, and several times a second as the guard's own sign of life.
struct StatusMessage {
  LaserHead::Status status;  ///< read_s is not sent
  std::int64_t read_ns = 0;  ///< when its reading was begun, on the machine's monotonic clock
  bool is_gate_on = false;
  std::uint64_t requested_readings = 0;  ///< how many of them have come
};
std::string encode(const StatusMessage& message);
std::optional<StatusMessage> decode_status(std::string_view message);

}  // namespace hilbrush::guard
