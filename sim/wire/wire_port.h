#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "sim/wire/wire_session.h"

/// Sockets and pseudo-terminals as the serving thread uses them: nothing here waits.
namespace hilbrush {

/// Owns a descriptor.
class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  ~Descriptor();
  Descriptor(Descriptor&& other) noexcept : fd_(other.release()) {}
  Descriptor& operator=(Descriptor&& other) noexcept;
  int get() const { return fd_; }
  bool is_open() const { return fd_ >= 0; }
  int release();

 private:
  int fd_;
};

/// A TCP port of the loopback interface, chosen by the system.
class ListeningPort {
 public:
  ListeningPort();
  std::uint16_t port() const { return port_; }
  int fd() const { return fd_.get(); }
  /// The next client's connection, or a closed descriptor.
  Descriptor accept() const;

 private:
  Descriptor fd_;
  std::uint16_t port_ = 0;
};

/// A pseudo-terminal in raw mode: we hold the master; the slave stays open, so that a client that closes it
/// does not hang it up.
struct PseudoTerminal {
  PseudoTerminal();
  Descriptor master, slave;
  std::string path;
};

/// A session and the descriptor it talks through.
class Connection {
 public:
  Connection(Descriptor fd, std::unique_ptr<WireSession> session, bool is_permanent)
      : fd_(std::move(fd)), session_(std::move(session)), is_permanent_(is_permanent) {}

  int fd() const { return fd_.get(); }
  WireSession& session() { return *session_; }
  bool wants_to_write() const { return !unsent_.empty(); }
  /// Hands what has arrived to the session.
  void read();
  /// Sends what is due, as much as goes.
  void write();
  /// Closed by either side, or hopelessly behind. A permanent connection (a serial line) never is.
  bool is_over() const { return !is_permanent_ && (is_over_ || session_->is_dropped()); }

 private:
  static constexpr std::size_t kUnsentMax = 1u << 18;
  Descriptor fd_;
  std::unique_ptr<WireSession> session_;
  const bool is_permanent_;
  std::string unsent_;
  bool is_over_ = false;
};

}  // namespace hilbrush
