#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "drivers/driver_error.h"
#include "drivers/link/message_ring.h"

/// Byte links to devices: TCP, and serial ports by libserialport. Every call has a deadline in wall time; a
/// hang-up is distinguished from silence.
namespace hilbrush {

/// The connection is lost, or it is not known which command an answer belongs to: the link must be opened
/// again.
struct LinkError : DriverError {
  using DriverError::DriverError;
};

using Deadline = std::chrono::steady_clock::time_point;
Deadline deadline_in(double wall_s);
/// For poll(): rounded up, 0 when it has passed, an hour at most.
int milliseconds_until(Deadline deadline);

class Link {
 public:
  virtual ~Link();
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  /// All of `bytes`, in one write if the system takes them at once. One thread at a time.
  /// @throws LinkError if the peer hung up, or the bytes weren't taken by the deadline.
  void write(std::string_view bytes, Deadline deadline);
  /// What has arrived, at least one byte; 0 if nothing came by the deadline. One thread at a time.
  /// @throws LinkError if the peer hung up or interrupt() was called.
  std::size_t read(char* bytes, std::size_t size, Deadline deadline);
  /// Ends a read or write that is under way; all later calls throw. From any thread, never blocks.
  void interrupt() noexcept;
  /// Takes what has arrived and throws it away: replies that came too late.
  void discard_input();

  int descriptor() const { return fd_; }
  const std::string& name() const { return name_; }  ///< "192.168.1.6:29999" or "/dev/ttyUSB0"
  MessageRing& messages() { return messages_; }

 protected:
  Link(int fd, std::string name);
  /// Waits for `events`; false at the deadline.
  bool wait_for(short events, Deadline deadline);
  [[noreturn]] void lost(const std::string& what) const;

  int fd_ = -1;

 private:
  std::string name_;
  int interrupt_fd_ = -1;
  MessageRing messages_;
};

/// @throws LinkError "HOST:PORT: ..." if no connection is accepted by the deadline. Small messages are sent
/// at once (no Nagle).
std::unique_ptr<Link> open_tcp_link(const std::string& host, std::uint16_t port, Deadline deadline);

enum class Parity { kNone, kEven, kOdd };

/// 8 data bits, 1 stop bit, no flow control; opened exclusively; old input thrown away. @throws LinkError
std::unique_ptr<Link> open_serial_link(const std::string& port, int baud, Parity parity);

/// A serial device's path, or "tcp://HOST:PORT" for a serial device server. @throws LinkError
std::unique_ptr<Link> open_link(const std::string& port, int baud, Parity parity, Deadline deadline);

/// Reads a byte stream as lines that end with any of CR and LF; empty lines are skipped.
class LineReader {
 public:
  static constexpr std::size_t kLineMax = 256;

  /// The next line without its end. @throws LinkError if none is whole by the deadline ("silence"), if it is
  /// longer than kLineMax, or if the link is lost.
  std::string read_line(Link& link, Deadline deadline);
  void clear() { buffer_.clear(); }

 private:
  std::string buffer_;
};

}  // namespace hilbrush
