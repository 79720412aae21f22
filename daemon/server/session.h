#pragma once
// <utility> comes first because Asio 1.18 forgets it under C++20.
#include <array>
#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "daemon/server/server.h"

/// One connection of the server: its lines, its requests in their turn, its answers and updates. All of it
/// happens on the socket thread. Included by server.cpp and session.cpp only, which are the ones that see
/// Asio.
namespace hilbrush {

namespace asio = boost::asio;
using Stream = asio::generic::stream_protocol;

/// The answers of one batch; sent as one line when the last has come.
struct Batch {
  std::size_t awaited = 0;
  std::string text;
};

/// A request that waits for its turn.
struct Waiting {
  RpcElement element;
  std::function<void(std::string)> send;
  std::shared_ptr<const Batch> batch;  ///< if it is of one
};

/// One connection. Lives as long as an operation of its socket does.
class Session : public std::enable_shared_from_this<Session> {
 public:
  using OnSession = std::function<void(const std::shared_ptr<Session>&)>;

  /// `on_waiting`: a request waits, and serve_next() is to be called.
  Session(Stream::socket socket, Peer peer, const ServerLimits& limits, const Services& services,
          OnSession on_waiting, OnSession on_closed, TokenFailures& token_failures)
      : socket_(std::move(socket)),
        limits_(limits),
        services_(services),
        on_waiting_(std::move(on_waiting)),
        on_closed_(std::move(on_closed)),
        token_failures_(token_failures),
        peer_(std::move(peer)),
        identify_timer_(socket_.get_executor()) {}

  void begin();
  void close();
  void notify(const Job& job);
  /// One request of those that wait.
  void serve_next();
  const Peer& peer() const { return peer_; }
  bool is_stranger() const { return !peer_.may_look; }
  bool is_remote() const { return !peer_.address.empty(); }

 private:
  void read();
  void take(std::size_t count);
  void serve_stops(std::size_t from);
  void serve_stop(std::size_t begin, std::size_t end);
  void ask_for_turn();
  void go_on();
  std::optional<std::size_t> line_end();
  void take_line();
  void queue_requests(std::string_view line);
  void refuse_long_line();
  bool is_overtaken(const RpcElement& element) const;
  std::optional<RpcFault> refusal(const Waiting& waiting) const;
  static void refuse(const Waiting& waiting, const RpcFault& fault);
  void answer(const RpcElement& element, std::function<void(std::string)> send);
  Caller caller();
  std::optional<Peer> identify(const std::string& token);
  bool may_serve() const {
    return unread_bytes() < limits_.unread_bytes && pending_replies_ < limits_.pending_replies;
  }
  std::size_t unread_bytes() const { return outbox_.size() + writing_.size(); }
  std::size_t waiting_bytes() const { return inbox_.size() - served_; }
  std::size_t line_bytes_max() const { return is_stranger() ? limits_.stranger_bytes : limits_.line_bytes; }
  void send(const std::string& line);
  void write();
  void send_updates();
  void close_if_done();

  Stream::socket socket_;
  const ServerLimits limits_;
  const Services services_;
  const OnSession on_waiting_, on_closed_;
  TokenFailures& token_failures_;
  Peer peer_;
  asio::steady_timer identify_timer_;  ///< runs while the connection has not identified itself
  std::array<char, 65536> chunk_{};
  std::string inbox_;             ///< bytes not yet served: at most a line and two chunks
  std::size_t served_ = 0;        ///< of inbox_: everything before is served
  std::size_t searched_ = 0;      ///< of inbox_: no line that is not yet served ends before
  std::size_t last_line_ = 0;     ///< of inbox_: where the line begins that has not yet ended
  std::size_t stop_end_ = 0;      ///< of inbox_: a stop up to here was served before its turn
  std::deque<Waiting> requests_;  ///< of the line whose turn it is
  bool are_requests_overtaken_ = false;
  bool is_stop_pending_ = false;  ///< one that was served before its turn is not yet answered
  std::string outbox_, writing_;  ///< not yet handed to the system, being handed
  std::size_t pending_replies_ = 0;
  std::set<std::int64_t> watched_, pending_updates_;  ///< jobs; those that changed since their last update
  bool is_reading_ = false;
  bool is_writing_ = false;
  bool has_asked_ = false;   ///< for a turn
  bool is_at_end_ = false;   ///< nothing more is read
  bool is_refused_ = false;  ///< by a wrong token, or none: what it sends after that is not read
  bool is_closed_ = false;
};

}  // namespace hilbrush
