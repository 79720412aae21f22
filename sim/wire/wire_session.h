#pragma once
#include <cstdint>
#include <deque>
#include <string>
#include <string_view>

#include "sim/wire/fault_injector.h"

/// One end of a conversation with a simulated device, without input or output: bytes in, bytes out, at the
/// cell's present time. A protocol says where a message ends, obeys and answers it; faults of the exchange
/// happen here, the same way for all of them. One thread, the cell's.
namespace hilbrush {

class WireSession {
 public:
  /// Longest line or frame that any device here takes.
  static constexpr std::size_t kMaxMessage = 1024;

  WireSession(WireDevice device, TrueCell& cell, FaultInjector& faults)
      : cell_(cell), faults_(faults), device_(device), cuts_before_(faults.cut_count(device)) {}
  virtual ~WireSession() = default;
  WireSession(const WireSession&) = delete;
  WireSession& operator=(const WireSession&) = delete;

  void receive(std::string_view bytes);
  /// What the device sends without being asked, up to the present.
  virtual void run() {}
  /// When take_output() or run() will next have something to do.
  virtual double next_event_s() const;
  /// All that is to be sent by now; taken away.
  std::string take_output();
  /// The device has closed the connection (what is still to be sent is lost). A serial line stays as it is.
  bool is_dropped() const { return is_dropped_ || faults_.cut_count(device_) != cuts_before_; }
  WireDevice device() const { return device_; }

 protected:
  /// Bytes of the first message in `buffer`, 0 if it is not whole. Bytes that begin no message are a message,
  /// too.
  virtual std::size_t message_bytes(std::string_view buffer) const = 0;
  /// Obeys, and says what is answered; empty: nothing.
  virtual std::string answer(std::string_view message) = 0;
  /// What a device answers that will not, or cannot.
  virtual std::string refusal(std::string_view message, bool has_failed) = 0;
  /// The answer as it would be to another message.
  virtual std::string misaddressed(std::string answer) const = 0;
  /// The answer damaged on its way.
  virtual std::string damaged(std::string answer) const;
  void send(std::string bytes, double due_s = 0);

  TrueCell& cell_;
  FaultInjector& faults_;

 private:
  struct Output {
    double due_s;
    std::string bytes;
  };
  void take_message(std::string_view message);

  const WireDevice device_;
  const std::uint64_t cuts_before_;  ///< the device's, when the session began
  std::string input_;
  std::deque<Output> output_;  ///< in the order of sending; a late one holds up what follows
  bool is_dropped_ = false;
};

}  // namespace hilbrush
