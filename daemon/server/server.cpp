// The one translation unit that includes Asio. <utility> comes first because Asio 1.18 forgets it under C++20.
#include "daemon/server/server.h"

#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <boost/asio/buffer.hpp>
#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <csignal>
#include <cstring>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <unordered_set>
#include <utility>
#include <vector>

#include "sampling/base/check.h"

namespace hilbrush {
namespace {

namespace asio = boost::asio;
using Local = asio::local::stream_protocol;
using Tcp = asio::ip::tcp;
using Stream = asio::generic::stream_protocol;

Peer peer_of(Local::socket& socket, const Access& access) {
  ucred credentials{};
  socklen_t length = sizeof credentials;
  CHECK(::getsockopt(socket.native_handle(), SOL_SOCKET, SO_PEERCRED, &credentials, &length) == 0);
  std::vector<gid_t> groups(1024);
  length = static_cast<socklen_t>(groups.size() * sizeof(gid_t));
  if (::getsockopt(socket.native_handle(), SOL_SOCKET, SO_PEERGROUPS, groups.data(), &length) != 0) length = 0;
  groups.resize(length / sizeof(gid_t));
  return access.local_peer(credentials.uid, credentials.gid, credentials.pid, groups);
}

/// The answers of one batch; sent as one line when the last has come.
struct Batch {
  std::size_t awaited = 0;
  std::string text;
};

}  // namespace

/// One connection. Lives as long as an operation of its socket does.
class Session : public std::enable_shared_from_this<Session> {
 public:
  using OnClosed = std::function<void(const std::shared_ptr<Session>&)>;

  Session(Stream::socket socket, Peer peer, const ServerLimits& limits, const Services& services, OnClosed on_closed)
      : socket_(std::move(socket)),
        limits_(limits),
        services_(services),
        on_closed_(std::move(on_closed)),
        peer_(std::move(peer)),
        identify_timer_(socket_.get_executor()) {}

  void begin();
  void close();
  void notify(const Job& job);

 private:
  void read();
  void take(std::size_t count);
  void serve_lines();
  void serve(std::string_view line);
  void answer(const RpcElement& element, std::function<void(std::string)> send);
  Caller caller();
  std::optional<Peer> identify(const std::string& token);
  bool may_serve() const { return unread_bytes() < limits_.unread_bytes && pending_replies_ < limits_.pending_replies; }
  std::size_t unread_bytes() const { return outbox_.size() + writing_.size(); }
  void send(const std::string& line);
  void write();
  void send_updates();
  void close_if_done();

  Stream::socket socket_;
  const ServerLimits limits_;
  const Services services_;
  const OnClosed on_closed_;
  Peer peer_;
  asio::steady_timer identify_timer_;  ///< runs while the connection has not identified itself
  std::array<char, 65536> chunk_{};
  std::string inbox_;             ///< bytes not yet served: at most a line and a chunk
  std::size_t searched_ = 0;      ///< of inbox_: holds no end of line before
  std::string outbox_, writing_;  ///< not yet handed to the system, being handed
  std::size_t pending_replies_ = 0;
  std::set<std::int64_t> watched_, pending_updates_;  ///< jobs; those that changed since their last update
  bool is_reading_ = false;
  bool is_writing_ = false;
  bool is_serving_ = false;
  bool is_at_end_ = false;   ///< nothing more is read
  bool is_refused_ = false;  ///< by a wrong token
  bool is_closed_ = false;
};

void Session::begin() {
  if (peer_.user.empty()) {
    identify_timer_.expires_after(std::chrono::duration_cast<std::chrono::steady_clock::duration>(
        std::chrono::duration<double>(limits_.identify_s)));
    identify_timer_.async_wait([weak = weak_from_this()](const boost::system::error_code& error) {
      if (const auto self = weak.lock(); self && !error && self->peer_.user.empty()) self->close();
    });
  }
  read();
}

std::optional<Peer> Session::identify(const std::string& token) {
  const std::string address = peer_.address;
  auto peer = services_.access.token_peer(token, address);
  if (peer) {
    peer_ = *peer;
    identify_timer_.cancel();
  } else {
    is_refused_ = true;  // what it sends after a wrong token is not read
  }
  return peer;
}

void Session::read() {
  if (is_reading_ || is_at_end_ || is_closed_ || !may_serve()) return;
  is_reading_ = true;
  socket_.async_read_some(asio::buffer(chunk_),
                          [self = shared_from_this()](const boost::system::error_code& error, std::size_t count) {
                            self->is_reading_ = false;
                            if (self->is_closed_) return;
                            if (error == asio::error::eof)
                              self->is_at_end_ = true;
                            else if (error)
                              return self->close();
                            self->take(count);
                          });
}

void Session::take(std::size_t count) {
  inbox_.append(chunk_.data(), count);
  serve_lines();
}

/// As long as the client reads its answers; otherwise the rest waits, and nothing more is read.
void Session::serve_lines() {
  if (is_serving_ || is_closed_) return;
  is_serving_ = true;
  std::size_t begin = 0;
  while (!is_closed_ && !is_refused_ && may_serve()) {
    const auto end = inbox_.find('\n', std::max(begin, searched_));
    if (end == std::string::npos) {
      searched_ = inbox_.size();
      break;
    }
    const std::string_view line(inbox_.data() + begin, end - begin);
    if (line.size() > limits_.line_bytes) break;
    serve(line);
    begin = searched_ = end + 1;
  }
  inbox_.erase(0, begin);
  searched_ -= std::min(searched_, begin);
  is_serving_ = false;
  if (is_refused_) {
    inbox_.clear();
    searched_ = 0;
    is_at_end_ = true;
  }
  if (inbox_.size() > limits_.line_bytes && inbox_.find('\n') > limits_.line_bytes) {
    inbox_.clear();
    searched_ = 0;
    is_at_end_ = true;
    send(rpc_fault(nullptr, {kRpcParse, "a message has at most " + std::to_string(limits_.line_bytes) + " bytes", ""}));
  }
  close_if_done();
  read();
}

void Session::serve(std::string_view line) {
  if (line.find_first_not_of(" \t\r") == std::string_view::npos) return;
  const RpcMessage message = parse_rpc(line);
  const std::weak_ptr<Session> weak = weak_from_this();
  if (!message.is_batch) {
    return answer(message.elements.front(), [weak](const std::string& text) {
      if (const auto self = weak.lock()) self->send(text);
    });
  }
  const auto batch = std::make_shared<Batch>();
  for (const auto& element : message.elements) {
    const auto* request = std::get_if<RpcRequest>(&element.content);
    if (request == nullptr || !request->is_notification) ++batch->awaited;
  }
  for (const auto& element : message.elements)
    answer(element, [weak, batch](const std::string& text) {
      batch->text += (batch->text.empty() ? "[" : ",") + text;
      if (--batch->awaited > 0) return;
      if (const auto self = weak.lock()) self->send(batch->text + "]");
    });
}

Caller Session::caller() {
  const std::weak_ptr<Session> weak = weak_from_this();
  return {peer_,
          [weak](const std::string& token) {
            const auto self = weak.lock();
            return self ? self->identify(token) : std::nullopt;
          },
          [weak](std::int64_t job) {
            if (const auto self = weak.lock()) self->watched_.insert(job);
          },
          [weak](std::int64_t job) {
            if (const auto self = weak.lock()) {
              self->watched_.erase(job);
              self->pending_updates_.erase(job);
            }
          }};
}

void Session::answer(const RpcElement& element, std::function<void(std::string)> send) {
  if (const auto* fault = std::get_if<RpcFault>(&element.content)) return send(rpc_fault(element.id, *fault));
  const auto& request = std::get<RpcRequest>(element.content);
  if (request.is_notification)
    return services_.methods.dispatch(request, caller(), {[](const Json&) {}, [](const RpcFault&) {}});
  ++pending_replies_;
  const std::weak_ptr<Session> weak = weak_from_this();
  const auto finish = [weak, send = std::move(send)](const std::string& text) {
    if (const auto self = weak.lock()) {
      --self->pending_replies_;
      send(text);
      self->serve_lines();
    }
  };
  services_.methods.dispatch(request, caller(),
                             {[finish, id = request.id](Json result) { finish(rpc_result(id, std::move(result))); },
                              [finish, id = request.id](const RpcFault& fault) { finish(rpc_fault(id, fault)); }});
}

void Session::send(const std::string& line) {
  if (is_closed_) return;
  outbox_ += line;
  outbox_ += '\n';
  write();
}

void Session::write() {
  if (is_writing_ || is_closed_ || outbox_.empty()) return;
  is_writing_ = true;
  writing_ = std::exchange(outbox_, {});
  asio::async_write(socket_, asio::buffer(writing_),
                    [self = shared_from_this()](const boost::system::error_code& error, std::size_t) {
                      self->is_writing_ = false;
                      self->writing_.clear();
                      if (self->is_closed_) return;
                      if (error) return self->close();
                      self->write();
                      self->send_updates();
                      self->serve_lines();
                    });
}

void Session::notify(const Job& job) {
  if (!watched_.contains(job.id)) return;
  pending_updates_.insert(job.id);
  send_updates();
}

/// Updates are sent when nothing else waits to be read, each with the state at that moment: a slow client gets fewer of
/// them, never a queue.
void Session::send_updates() {
  if (is_writing_ || is_closed_ || is_at_end_) return;
  for (const std::int64_t id : std::exchange(pending_updates_, {})) {
    const auto job = services_.queue.jobs().find(id);
    if (job != services_.queue.jobs().end())
      send(rpc_notification("job.update", {{"seq", job->second.seq}, {"job", job_to_json(job->second)}}));
  }
}

/// A client that has closed its side still gets its answers.
void Session::close_if_done() {
  const bool has_request = inbox_.find('\n') != std::string::npos;
  if (is_at_end_ && !is_closed_ && !has_request && pending_replies_ == 0 && outbox_.empty() && !is_writing_) close();
}

void Session::close() {
  if (std::exchange(is_closed_, true)) return;
  boost::system::error_code ignored;
  socket_.close(ignored);
  on_closed_(shared_from_this());
}

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
  std::unordered_set<std::shared_ptr<Session>> sessions;

  Peer identify_peer(Local::socket& socket, const Services& services) { return peer_of(socket, services.access); }
  /// Not identified yet.
  Peer identify_peer(Tcp::socket& socket, const Services&) {
    boost::system::error_code error;
    const auto remote = socket.remote_endpoint(error);
    socket.set_option(Tcp::no_delay(true), error);
    Peer peer;
    if (!error) peer.address = remote.address().to_string() + ":" + std::to_string(remote.port());
    return peer;
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
      // Beyond the limit the connection is closed at once, which the client sees.
      if (sessions.size() < limits.clients) {
        Peer peer = identify_peer(socket, services);
        const auto session =
            std::make_shared<Session>(std::move(socket), std::move(peer), limits, services,
                                      [this](const std::shared_ptr<Session>& gone) { sessions.erase(gone); });
        sessions.insert(session);
        session->begin();
      }
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
  const auto fail = [&](const std::string& sentence) { throw std::runtime_error(socket.string() + ": " + sentence); };
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
  // No client may connect before the mode is right, whatever the umask: the socket is bound without permissions, then
  // opened to the group, then listened on.
  const mode_t before = ::umask(0777);
  acceptor.bind(Local::endpoint(socket.string()), error);
  ::umask(before);
  if (error) fail("cannot be bound: " + error.message());
  implementation_->socket_file = socket;
  if (::chmod(socket.c_str(), 0660) != 0) fail(std::string("its mode cannot be set: ") + std::strerror(errno));
  acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (error) fail("cannot be listened on: " + error.message());
  implementation_->accept(acceptor, services);
}

std::uint16_t Server::listen_tcp(const std::string& host, std::uint16_t port, const Services& services) {
  boost::system::error_code error;
  const auto check = [&](const char* what) {
    if (error) throw std::runtime_error(host + ":" + std::to_string(port) + ": " + what + ": " + error.message());
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
  implementation_->poll(
      std::chrono::duration_cast<std::chrono::steady_clock::duration>(std::chrono::duration<double>(period_s)),
      std::move(task));
}

void Server::every(double period_s, std::function<void()> task) {
  implementation_->tick(
      std::make_shared<asio::steady_timer>(implementation_->context),
      std::chrono::duration_cast<std::chrono::steady_clock::duration>(std::chrono::duration<double>(period_s)),
      std::move(task));
}

void Server::run() {
  implementation_->context.run();
}

void Server::end_run() {
  implementation_->context.stop();
}

}  // namespace hilbrush
