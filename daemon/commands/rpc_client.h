#pragma once
#include <chrono>
#include <cstddef>
#include <deque>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>

/// The client's end of the daemon's socket: JSON-RPC 2.0, one message a line, blocking, with a timeout on
/// everything.
namespace hilbrush {

/// No daemon, a lost or silent connection, or answers that are not JSON-RPC. what() is a sentence for the
/// operator.
class ConnectionError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The daemon refused a request.
class RpcRefusal : public std::runtime_error {
 public:
  RpcRefusal(int code, const std::string& message, std::string at)
      : std::runtime_error(message), code_(code), at_(std::move(at)) {}
  int code() const { return code_; }             ///< see config/rpc_errors.h
  const std::string& at() const { return at_; }  ///< file:line or JSON path; may be empty

 private:
  int code_;
  std::string at_;
};

/// Used by one thread at a time.
class RpcClient {
 public:
  using Milliseconds = std::chrono::milliseconds;

  static constexpr std::size_t kLineBytesMax = 64u << 20;
  /// Kept while an answer is waited for; older ones are dropped.
  static constexpr std::size_t kNotificationsMax = 4096;

  /// Connects to the path of a Unix socket, or to "tcp://HOST:PORT" with the token in $HILBRUSH_TOKEN.
  /// @throws ConnectionError, RpcRefusal (unknown token)
  explicit RpcClient(std::string socket_path, Milliseconds timeout = Milliseconds(10000));
  ~RpcClient();
  RpcClient(const RpcClient&) = delete;
  RpcClient& operator=(const RpcClient&) = delete;

  /// Sends a request and returns its result. Notifications that come in between are kept.
  /// @throws RpcRefusal, ConnectionError (also if there is no answer in time; the connection cannot be used
  /// after that)
  nlohmann::ordered_json call(const std::string& method, const nlohmann::ordered_json& params,
                              std::optional<Milliseconds> timeout = {});

  struct Notification {
    std::string method;
    nlohmann::ordered_json params;
  };
  /// The next notification, or nothing if none comes in time. @throws ConnectionError
  std::optional<Notification> next_notification(Milliseconds timeout);

  /// For poll(). When it is readable, call next_notification().
  int descriptor() const { return descriptor_; }

 private:
  using Deadline = std::chrono::steady_clock::time_point;

  void connect_until(Deadline deadline);
  void connect_tcp(Deadline deadline);
  void send_line(const std::string& line, Deadline deadline);
  std::optional<std::string> read_line(Deadline deadline);
  std::optional<nlohmann::ordered_json> read_message(Deadline deadline);
  void keep(const nlohmann::ordered_json& notification);

  std::string path_;
  Milliseconds timeout_;
  int descriptor_ = -1;
  long next_id_ = 1;
  std::string buffer_;        ///< received bytes that are not yet a whole line
  std::size_t searched_ = 0;  ///< bytes of buffer_ known to have no line end
  std::deque<Notification> notifications_;
};

}  // namespace hilbrush
