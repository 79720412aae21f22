#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>

#include "daemon/server/access.h"
#include "daemon/server/job.h"
#include "daemon/server/method_table.h"

/// The Unix socket, and a TCP one if it is wanted: JSON-RPC 2.0, one message a line. One thread; requests
/// never wait behind work. Clients do not disturb each other: a line is bounded; connections take turns, one
/// request at each turn; a client that does not read is not read from either, and its notifications are kept
/// as the numbers of changed jobs, not as text. cell.stop is served as soon as its line has come: it
/// overtakes all requests that wait, and the acts of its own connection that it overtakes are refused.
namespace hilbrush {

struct ServerLimits {
  std::size_t line_bytes = std::size_t{1} << 20;  ///< longer: refused, and the connection closed
  std::size_t unread_bytes = std::size_t{1}
                             << 18;  ///< of answers a client has not read, before its requests wait
  std::size_t pending_replies = 64;  ///< of one client
  std::size_t clients = 1000;
  std::size_t tcp_clients = 800;  ///< of them: the rest is kept for local ones
  std::size_t strangers = 32;     ///< of them without any right; a further one replaces the oldest
  std::size_t stranger_bytes = std::size_t{1} << 12;     ///< of a line, as long as a client has no right
  std::size_t batch_reply_bytes = std::size_t{1} << 19;  ///< further requests of the batch are refused
  double identify_s = 10;  ///< a TCP connection that has not identified itself by then is closed
};

/// What the requests of a connection are served by; all outlive the server's run.
struct Services {
  const MethodTable& methods;
  const JobQueue& queue;
  const Access& access;
};

class Server {
 public:
  explicit Server(const ServerLimits& limits = {});
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Runs `task` on the socket thread. Any thread; tasks posted after the end of run() are dropped.
  void post(std::function<void()> task);
  /// Mode 0660. The caller has made sure that no other daemon uses the path; the socket of a dead one is
  /// removed.
  /// @throws std::runtime_error with a sentence.
  void listen(const std::filesystem::path& socket, const Services& services);
  /// On an address of this machine; port 0 takes any free one. @return the port. @throws std::runtime_error
  std::uint16_t listen_tcp(const std::string& host, std::uint16_t port, const Services& services);
  /// A job has changed: clients that watch it are notified. Socket thread.
  void notify(const Job& job);
  std::size_t client_count() const;

  /// Calls `task` once on SIGTERM or SIGINT, on the socket thread.
  void on_termination(std::function<void()> task);
  /// Calls `task` on the socket thread every `period_s` until it returns true.
  void poll(double period_s, std::function<bool()> task);
  /// Calls `task` on the socket thread every `period_s`, until the end.
  void every(double period_s, std::function<void()> task);
  /// Serves until end_run().
  void run();
  /// Any thread.
  void end_run();

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace hilbrush
