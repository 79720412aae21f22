#pragma once
#include <cmath>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/axes/mapped_drive.h"
#include "drivers/axes/oriental_az.h"
#include "drivers/dobot/dobot_codec.h"
#include "drivers/guard/guard_codec.h"
#include "drivers/guard/guard_process.h"
#include "drivers/laser/cobolt_codec.h"
#include "drivers/laser/obis_codec.h"
#include "drivers/link/line_codec.h"

namespace hilbrush {

namespace device_codecs {

inline void promise(bool is_kept) {
  if (!is_kept) std::abort();
}

/// The bytes in two pieces, cut where the first byte says: a network may cut them anywhere.
inline std::array<std::string_view, 2> in_two(std::string_view bytes) {
  const std::size_t cut = bytes.empty() ? 0 : static_cast<unsigned char>(bytes[0]) % (bytes.size() + 1);
  return {bytes.substr(0, cut), bytes.substr(cut)};
}

inline void decode_as_robot(std::string_view bytes) {
  dobot::FrameStream frames;
  std::size_t whole = 0;
  for (const std::string_view piece : in_two(bytes)) {
    frames.push(piece);
    while (const auto frame = frames.next()) {
      ++whole;
      for (std::size_t i = 0; i < 4; ++i)
        promise(std::isfinite(frame->actual[i]) && std::isfinite(frame->setpoint[i]));
      dobot::mode_name(frame->mode);
    }
  }
  promise(whole * dobot::kFrameBytes + frames.dropped_bytes() <= bytes.size());

  dobot::ReplyStream replies;
  for (const std::string_view piece : in_two(bytes)) {
    replies.push(piece);
    while (const auto text = replies.next())
      if (const auto reply = dobot::decode_reply(*text)) {
        promise(dobot::is_echo(reply->command, reply->command));
        promise(!dobot::error_text(reply->error).empty());
      }
  }
}

inline void decode_as_laser_head(std::string_view bytes) {
  obis::classify(bytes);
  obis::decode_switch(bytes);
  if (const auto word = obis::decode_hex_word(bytes)) obis::fault_text(*word);
  cobolt::is_ok(bytes);
  if (const auto number = line_codec::decode_number(bytes)) promise(std::isfinite(*number));
  if (const auto fault = line_codec::decode_integer(bytes)) cobolt::fault_text(*fault);
}

inline void decode_as_laser_guard(std::string_view bytes) {
  if (const auto request = guard::decode_request(bytes)) {
    const auto again = guard::decode_request(guard::encode(*request));
    promise(again && again->verb == request->verb && again->value == request->value);
  }
  guard::decode_reply(bytes);
  if (const auto status = guard::decode_status(bytes)) {
    const auto again = guard::decode_status(guard::encode(*status));
    promise(again && again->read_ns == status->read_ns && again->status.state == status->status.state);
  }
  std::vector<std::string> words;
  for (std::size_t start = 0; start < bytes.size();) {
    const std::size_t end = std::min(bytes.find(' ', start), bytes.size());
    words.emplace_back(bytes.substr(start, end - start));
    start = end + 1;
  }
  try {
    from_command_line(words);
  } catch (const DriverError&) {
    // refused: fine
  }
}

inline void decode_as_drive(std::string_view bytes) {
  if (bytes.size() < 10) return;
  const auto word_at = [&](std::size_t i) {
    return static_cast<std::uint16_t>(static_cast<unsigned char>(bytes[i]) << 8 |
                                      static_cast<unsigned char>(bytes[i + 1]));
  };
  const std::array<std::uint16_t, 4> position{word_at(0), word_at(2), word_at(4), word_at(6)};
  oriental_az::alarm_text(oriental_az::decode_reading(word_at(8), position).alarm);
  MappedRegister reg;
  reg.words = 2;
  reg.is_signed = (bytes[9] & 1) != 0;
  reg.is_high_word_first = (bytes[9] & 2) != 0;
  const std::int64_t value = register_map::decode(reg, std::span(position).first(2));
  promise(register_map::decode(
              reg, register_map::encode(reg, register_map::to_register(reg, static_cast<double>(value)))) ==
          value);
}

}  // namespace device_codecs

/// Runs everything that decodes what devices send on the same bytes; aborts where a promise is broken.
inline void decode_as_every_device(std::string_view bytes) {
  device_codecs::decode_as_robot(bytes);
  device_codecs::decode_as_laser_head(bytes);
  device_codecs::decode_as_laser_guard(bytes);
  device_codecs::decode_as_drive(bytes);
}

}  // namespace hilbrush
