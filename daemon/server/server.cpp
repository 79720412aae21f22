#include "daemon/server/server.h"

#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <csignal>
#include <deque>
#include <unordered_set>
#include <utility>
#include <vector>

#include "daemon/server/session.h"

namespace hilbrush {
namespace {

using Local = asio::local::stream_protocol;
using Tcp = asio::ip::tcp;

/// Without any right if the system does not say who it is.
Peer peer_of(Local::socket& socket, const Access& access) {
  ucred credentials{};
  socklen_t length = sizeof credentials;
  if (::getsockopt(socket.native_handle(), SOL_SOCKET, SO_PEERCRED, &credentials, &length) != 0) return {};
  std::vector<gid_t> groups(1024);
  length = static_cast<socklen_t>(groups.size() * sizeof(gid_t));
  if (::getsockopt(socket.native_handle(), SOL_SOCKET, SO_PEERGROUPS, groups.data(), &length) != 0)
    length = 0;
  groups.resize(length / sizeof(gid_t));
  return access.local_peer(credentials.uid, credentials.gid, credentials.pid, groups);
}

}  // namespace

struct Server::Implementation {
  explicit Implementation(const ServerLimits& server_limits) : limits(server_limits) {}

  ServerLimits limits;
  asio::io_context context{1};
  asio::executor_work_guard<asio::io_context::executor_type> work{context.get_executor()};
  Local::acceptor acceptor{context};
  Tcp::acceptor tcp_acceptor{context};
  asio::signal_set signals{context};
  asio::steady_timer poll_timer{context};
  std::filesystem::path socket_file;
  TokenFailures token_failures;
  std::unordered_set<std::shared_ptr<Session>> sessions;
  std::deque<std::weak_ptr<Session>>
      strangers;                             ///< the oldest first; some have got rights since, or are gone
  std::deque<std::weak_ptr<Session>> turns;  ///< sessions with a request that waits, each at most once

  Peer identify_peer(Local::socket& socket, const Services& services) {
    return peer_of(socket, services.access);
  }
  /// Not identified yet.
  Peer identify_peer(Tcp::socket& socket, const Services&) {
    boost::system::error_code error;
    const auto remote = socket.remote_endpoint(error);
    socket.set_option(Tcp::no_delay(true), error);
    Peer peer;
    peer.address = error ? "unknown" : remote.address().to_string() + ":" + std::to_string(remote.port());
    return peer;
  }

  /// Beyond the limits a connection is closed at once, which its client sees.
  template <class Socket>
  void begin_session(Socket socket, const Services& services) {
    Peer peer = identify_peer(socket, services);
    const bool is_remote = !peer.address.empty();
    if (!peer.may_look) make_room_for_stranger();
    if (sessions.size() >= limits.clients || (is_remote && remote_count() >= limits.tcp_clients)) return;
    const auto session = std::make_shared<Session>(
        std::move(socket), std::move(peer), limits, services,
        [this](const std::shared_ptr<Session>& waiting) { give_turn(waiting); },
        [this](const std::shared_ptr<Session>& gone) { sessions.erase(gone); }, token_failures);
    sessions.insert(session);
    if (session->is_stranger()) strangers.push_back(session);
    session->begin();
  }

  std::size_t remote_count() const {
    return static_cast<std::size_t>(std::count_if(sessions.begin(), sessions.end(),
                                                  [](const auto& session) { return session->is_remote(); }));
  }

  /// The oldest goes: a client with a token identifies itself at once.
  void make_room_for_stranger() {
    std::erase_if(strangers, [](const std::weak_ptr<Session>& known) {
      const auto session = known.lock();
      return !session || !session->is_stranger();
    });
    if (strangers.size() < limits.strangers) return;
    if (const auto oldest = strangers.front().lock()) oldest->close();
    strangers.pop_front();
  }

  /// One request at each turn; between two turns everything is received that has come meanwhile, and its
  /// stops are served.
  void give_turn(const std::shared_ptr<Session>& session) {
    turns.push_back(session);
    if (turns.size() == 1) asio::post(context, [this] { serve_turn(); });
  }

  void serve_turn() {
    const auto session = turns.front().lock();
    if (session) session->serve_next();
    turns.pop_front();
    if (!turns.empty()) asio::post(context, [this] { serve_turn(); });
  }

  template <class Acceptor>
  void accept(Acceptor& from, const Services& services) {
    from.async_accept([this, &from, services](const boost::system::error_code& error, auto socket) {
      if (error == asio::error::operation_aborted) return;
      if (error) {  // out of descriptors, most likely: other sessions will close theirs
        const auto retry = std::make_shared<asio::steady_timer>(context, std::chrono::milliseconds(100));
        retry->async_wait([this, &from, services, retry](const boost::system::error_code& aborted) {
          if (!aborted) accept(from, services);
        });
        return;
      }
      begin_session(std::move(socket), services);
      accept(from, services);
    });
  }

  /// A tick that comes late does not bring others after it.
  void tick(const std::shared_ptr<asio::steady_timer>& timer, std::chrono::steady_clock::duration period,
            std::function<void()> task) {
    timer->expires_after(period);
    timer->async_wait([this, timer, period, task = std::move(task)](const boost::system::error_code& error) {
      if (error) return;
      task();
      tick(timer, period, task);
    });
  }

  void poll(std::chrono::steady_clock::duration period, std::function<bool()> task) {
    poll_timer.expires_after(period);
    poll_timer.async_wait([this, period, task = std::move(task)](const boost::system::error_code& error) {
      if (!error && !task()) poll(period, task);
    });
  }
};

Server::Server(const ServerLimits& limits) : implementation_(std::make_unique<Implementation>(limits)) {}

Server::~Server() {
  // Sessions erase themselves as they close; the set must not change under the loop.
  const auto sessions = std::exchange(implementation_->sessions, {});
  for (const auto& session : sessions) session->close();
  if (!implementation_->socket_file.empty()) ::unlink(implementation_->socket_file.c_str());
}

void Server::post(std::function<void()> task) {
  asio::post(implementation_->context, std::move(task));
}

void Server::listen(const std::filesystem::path& socket, const Services& services) {
  const auto fail = [&](const std::string& sentence) {
    throw std::runtime_error(socket.string() + ": " + sentence);
  };
  if (socket.string().size() >= sizeof(sockaddr_un::sun_path)) fail("is too long for a socket's path");
  struct stat status {};
  if (::lstat(socket.c_str(), &status) == 0) {
    if (!S_ISSOCK(status.st_mode)) fail("exists and is not a socket");
    if (::unlink(socket.c_str()) != 0)
      fail(std::string("the socket of an earlier daemon cannot be removed: ") + std::strerror(errno));
  }
  auto& acceptor = implementation_->acceptor;
  boost::system::error_code error;
  acceptor.open(Local(), error);
  if (error) fail("no socket can be made: " + error.message());
  // No client may connect before the mode is right, whatever the umask: the socket is bound without
  // permissions, then opened to the group, then listened on.
  const mode_t before = ::umask(0777);
  acceptor.bind(Local::endpoint(socket.string()), error);
  ::umask(before);
  if (error) fail("cannot be bound: " + error.message());
  implementation_->socket_file = socket;
  if (::chmod(socket.c_str(), 0660) != 0)
    fail(std::string("its mode cannot be set: ") + std::strerror(errno));
  acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (error) fail("cannot be listened on: " + error.message());
  implementation_->accept(acceptor, services);
}

std::uint16_t Server::listen_tcp(const std::string& host, std::uint16_t port, const Services& services) {
  boost::system::error_code error;
  const auto check = [&](const char* what) {
    if (error)
      throw std::runtime_error(host + ":" + std::to_string(port) + ": " + what + ": " + error.message());
  };
  const auto address = asio::ip::make_address(host, error);
  check("is not an address");
  auto& acceptor = implementation_->tcp_acceptor;
  const Tcp::endpoint endpoint(address, port);
  acceptor.open(endpoint.protocol(), error);
  check("no socket can be made");
  acceptor.set_option(Tcp::acceptor::reuse_address(true), error);
  acceptor.bind(endpoint, error);
  check("cannot be bound");
  acceptor.listen(asio::socket_base::max_listen_connections, error);
  check("cannot be listened on");
  implementation_->accept(acceptor, services);
  return acceptor.local_endpoint().port();
}

void Server::notify(const Job& job) {
  // A session may close itself meanwhile.
  const auto sessions = implementation_->sessions;
  for (const auto& session : sessions) session->notify(job);
}

std::size_t Server::client_count() const {
  return implementation_->sessions.size();
}

void Server::on_termination(std::function<void()> task) {
  implementation_->signals.add(SIGTERM);
  implementation_->signals.add(SIGINT);
  implementation_->signals.async_wait([task = std::move(task)](const boost::system::error_code& error, int) {
    if (!error) task();
  });
}

void Server::poll(double period_s, std::function<bool()> task) {
  implementation_->poll(std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                            std::chrono::duration<double>(period_s)),
                        std::move(task));
}

void Server::every(double period_s, std::function<void()> task) {
  implementation_->tick(std::make_shared<asio::steady_timer>(implementation_->context),
                        std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                            std::chrono::duration<double>(period_s)),
                        std::move(task));
}

void Server::run() {
  implementation_->context.run();
}

void Server::end_run() {
  implementation_->context.stop();
}

}  // namespace hilbrush
