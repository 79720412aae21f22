#pragma once
#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

#include "sim/wire/wired_devices.h"
#include "tests/daemon/execution/program_fixture.h"

/// The wired devices under virtual time: a test says what bytes arrive and how much time passes.
namespace hilbrush::test {

class WireWorld {
 public:
  explicit WireWorld(WireOptions options = quick()) : devices(small_cell(), options) {
    devices.cell().set_sink([this](const Emission& emission) { emissions.push_back(emission); });
  }
  /// No start delay; a step of a ten-thousandth of a degree.
  static WireOptions quick() {
    WireOptions options;
    options.start_delay_s = 0;
    options.steps_per_deg = 10'000;
    return options;
  }
  void pass(double duration_s) { devices.advance(devices.cell().now_s() + duration_s); }
  double now_s() { return devices.cell().now_s(); }
  std::unique_ptr<WireSession> converse(WiredDevices::Conversation about) { return devices.converse(about); }

  /// What a session says to bytes that arrive now.
  std::string ask(WireSession& session, const std::string& bytes) {
    session.receive(bytes);
    devices.observe();
    session.run();
    return session.take_output();
  }
  /// What it says by now without being asked.
  std::string hear(WireSession& session) {
    session.run();
    return session.take_output();
  }

  WiredDevices devices;
  std::vector<Emission> emissions;
};

using Conversation = WiredDevices::Conversation;

inline std::string from_hex(const std::string& text) {
  std::string bytes, digits;
  for (const char c : text)
    if (c != ' ') digits += c;
  for (std::size_t i = 0; i + 1 < digits.size(); i += 2)
    bytes += static_cast<char>(std::stoi(digits.substr(i, 2), nullptr, 16));
  return bytes;
}

inline std::string with_crc(const std::string& hex) {
  std::string frame = from_hex(hex);
  const std::uint16_t crc = modbus_crc(frame);
  frame += static_cast<char>(crc & 0xff);
  frame += static_cast<char>(crc >> 8);
  return frame;
}

inline std::string to_hex(const std::string& bytes) {
  std::string text;
  for (const char c : bytes)
    text += fmt::format("{}{:02X}", text.empty() ? "" : " ", static_cast<unsigned char>(c));
  return text;
}

}  // namespace hilbrush::test
