#pragma once
#include <array>
#include <cstring>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "drivers/dobot/dobot_codec.h"
#include "tests/drivers/loopback.h"

namespace hilbrush::test {

/// A feedback packet as the manual's table of offsets has it.
inline std::string dobot_packet(const dobot::Frame& frame) {
  std::string bytes(dobot::kFrameBytes, '\0');
  const auto put = [&](std::size_t at, const auto& value) {
    std::memcpy(bytes.data() + at, &value, sizeof value);
  };
  put(0, std::uint16_t{1440});
  put(16, frame.digital_outputs);
  put(24, static_cast<std::uint64_t>(frame.mode));
  put(32, frame.time_ms);
  put(48, std::uint64_t{0x0123456789ABCDEF});
  put(192, frame.setpoint);
  put(432, frame.actual);
  put(480, frame.speed);
  put(1026, std::uint8_t{frame.is_enabled});
  put(1028, std::uint8_t{frame.is_running});
  put(1029, std::uint8_t{frame.has_error});
  return bytes;
}

/// A Dobot controller that does nothing by itself: it accepts every command, and sends the frames it is
/// given.
class DobotPeer {
 public:
  std::uint16_t dashboard_port() const { return dashboard_.port(); }
  std::uint16_t motion_port() const { return motion_.port(); }
  std::uint16_t feedback_port() const { return feedback_.port(); }

  /// Sends to the client of the feedback port; waits until there is one.
  void show(const dobot::Frame& frame) {
    while (!feedback_.send(dobot_packet(frame))) std::this_thread::yield();
  }
  /// The queue has come to the Sync of a pulse.
  void finish_pulse() { motion_.send("0,{},Sync();"); }
  /// What the dashboard received since the last call.
  std::vector<std::string> take_orders() { return dashboard_.take(); }

 private:
  /// Answers each command but those that are `kept`.
  class Port {
   public:
    explicit Port(std::string kept = {}) : kept_(std::move(kept)) {}
    std::uint16_t port() const { return server_.port(); }
    bool send(const std::string& bytes) { return server_.send(bytes); }
    std::vector<std::string> take() {
      const std::lock_guard lock(mutex_);
      return std::exchange(commands_, {});
    }

   private:
    void serve(int connection) {
      std::array<char, 1024> bytes{};
      std::string text;
      for (ssize_t n = 0; (n = ::recv(connection, bytes.data(), bytes.size(), 0)) > 0;)
        obey(text.append(bytes.data(), static_cast<std::size_t>(n)));
    }
    void obey(std::string& text) {
      for (std::size_t end = 0; (end = text.find(')')) != std::string::npos; text.erase(0, end + 1)) {
        const std::string command = text.substr(0, end + 1);
        {
          const std::lock_guard lock(mutex_);
          commands_.push_back(command);
        }
        const auto mode = std::to_string(static_cast<int>(dobot::Mode::kEnabled));
        if (command != kept_) send("0,{" + mode + "}," + command + ";");
      }
    }

    const std::string kept_;
    std::mutex mutex_;
    std::vector<std::string> commands_;  ///< under the mutex
    /// Last: its thread uses all of the above.
    LoopbackServer server_{[this](int connection) { serve(connection); }};
  };

  Port dashboard_, motion_{"Sync()"}, feedback_;
};

}  // namespace hilbrush::test
