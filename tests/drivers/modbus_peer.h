#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "drivers/number_text.h"
#include "tests/drivers/loopback.h"

namespace hilbrush::test {

/// The other end of a Modbus TCP connection: registers that are read and written, and every write as it came
/// over the wire, from the unit's number on. `obey` is called for each write, with all registers of its unit.
class ModbusPeer {
 public:
  using Registers = std::map<int, std::uint16_t>;

  explicit ModbusPeer(std::function<void(Registers&)> obey) : obey_(std::move(obey)) {}

  std::uint16_t port() const { return server_.port(); }
  void set(int unit, int address, std::uint16_t word) {
    const std::lock_guard lock(mutex_);
    units_[unit][address] = word;
  }
  /// The writes since the last call, in hex.
  std::vector<std::string> take_writes() {
    const std::lock_guard lock(mutex_);
    return std::exchange(writes_, {});
  }
  /// How many reads came after the last write: its sender has had the answer, or given up.
  std::size_t reads_since_write() {
    const std::lock_guard lock(mutex_);
    return reads_since_write_;
  }
  /// This many further writes get no answer, though they are carried out.
  void be_silent(int writes) {
    const std::lock_guard lock(mutex_);
    silent_writes_ = writes;
  }

 private:
  bool answer(int connection) {
    std::array<std::uint8_t, 260> frame{};
    constexpr std::size_t kHead = 6;
    if (::recv(connection, frame.data(), kHead, MSG_WAITALL) != static_cast<ssize_t>(kHead)) return false;
    const std::size_t length = frame[4] << 8 | frame[5];
    if (length < 2 || length > frame.size() - kHead) return false;
    if (::recv(connection, frame.data() + kHead, length, MSG_WAITALL) != static_cast<ssize_t>(length))
      return false;
    std::vector<std::uint8_t> reply(frame.begin(), frame.begin() + kHead + 2);
    {
      const std::lock_guard lock(mutex_);
      if (!carry_out(frame, length, reply)) return true;
    }
    reply[4] = 0;
    reply[5] = static_cast<std::uint8_t>(reply.size() - kHead);
    return ::send(connection, reply.data(), reply.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(reply.size());
  }

  /// Under the lock. False: no answer.
  bool carry_out(const std::array<std::uint8_t, 260>& frame, std::size_t length,
                 std::vector<std::uint8_t>& reply) {
    const auto word = [&](std::size_t i) { return static_cast<std::uint16_t>(frame[i] << 8 | frame[i + 1]); };
    Registers& registers = units_[frame[6]];
    const int address = word(8);
    constexpr std::uint8_t kRead = 3;
    constexpr std::uint8_t kWriteOne = 6;
    if (frame[7] == kRead) {
      ++reads_since_write_;
      reply.push_back(static_cast<std::uint8_t>(2 * word(10)));
      for (int i = 0; i < word(10); ++i) {
        reply.push_back(static_cast<std::uint8_t>(registers[address + i] >> 8));
        reply.push_back(static_cast<std::uint8_t>(registers[address + i] & 0xFF));
      }
      return true;
    }
    note_write(frame, length);
    reads_since_write_ = 0;
    if (frame[7] == kWriteOne)
      registers[address] = word(10);
    else
      for (int i = 0; i < word(10); ++i) registers[address + i] = word(13 + 2 * static_cast<std::size_t>(i));
    obey_(registers);
    for (std::size_t i = 8; i < 12; ++i) reply.push_back(frame[i]);
    return silent_writes_ <= 0 || silent_writes_-- <= 0;
  }

  void note_write(const std::array<std::uint8_t, 260>& frame, std::size_t length) {
    std::string text;
    for (std::size_t i = 6; i < 6 + length; ++i)
      text += (text.empty() ? "" : " ") + hex_text(static_cast<unsigned char>(frame[i]), 2);
    writes_.push_back(text);
  }

  const std::function<void(Registers&)> obey_;
  std::mutex mutex_;  ///< of what follows
  int silent_writes_ = 0;
  std::size_t reads_since_write_ = 0;
  std::map<int, Registers> units_;
  std::vector<std::string> writes_;
  /// Last: its thread uses all of the above.
  LoopbackServer server_{[this](int connection) {
    while (answer(connection)) {
    }
  }};
};

}  // namespace hilbrush::test
