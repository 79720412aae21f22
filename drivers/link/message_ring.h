#pragma once
#include <array>
#include <chrono>
#include <cstddef>
#include <mutex>
#include <string>
#include <string_view>

namespace hilbrush {

/// The last messages of one link, for the sentence of an error: what was said just before it went wrong.
/// Bounded: keeps kMessages of at most kTextMax bytes. Any thread.
class MessageRing {
 public:
  static constexpr std::size_t kMessages = 16;
  static constexpr std::size_t kTextMax = 96;

  void sent(std::string_view message) { add(true, message); }
  void received(std::string_view message) { add(false, message); }
  /// ` (last messages: sent "RobotMode()" 12.1 ms ago; received "0,{5},RobotMode();" 11.8 ms ago)`, oldest
  /// first, at most `count`; empty if there were none. Bytes that do not print are shown as \xNN.
  std::string text(std::size_t count = 4) const;

 private:
  using Steady = std::chrono::steady_clock;
  struct Message {
    bool is_sent = false;
    bool is_cut = false;
    Steady::time_point time;
    std::array<char, kTextMax> bytes{};
    std::size_t size = 0;
  };
  void add(bool is_sent, std::string_view message);

  mutable std::mutex mutex_;
  std::array<Message, kMessages> messages_;
  std::size_t count_ = 0;  ///< ever added
};

}  // namespace hilbrush
