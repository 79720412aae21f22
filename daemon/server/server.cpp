// The one translation unit that includes Asio. <utility> comes first because Asio 1.18 forgets it under C++20.
#include "daemon/server/server.h"

#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
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

namespace hilbrush {
namespace {

namespace asio = boost::asio;
using Local = asio::local::stream_protocol;
using Tcp = asio::ip::tcp;
using Stream = asio::generic::stream_protocol;

/// Without any right if the system does not say who it is.
Peer peer_of(Local::socket& socket, const Access& access) {
  ucred credentials{};
  socklen_t length = sizeof credentials;
  if (::getsockopt(socket.native_handle(), SOL_SOCKET, SO_PEERCRED, &credentials, &length) != 0) return {};
  std::vector<gid_t> groups(1024);
  length = static_cast<socklen_t>(groups.size() * sizeof(gid_t));
  if (::getsockopt(socket.native_handle(), SOL_SOCKET, SO_PEERGROUPS, groups.data(), &length) != 0) length = 0;
  groups.resize(length / sizeof(gid_t));
  return access.local_peer(credentials.uid, credentials.gid, credentials.pid, groups);
}

constexpr const char* kStop = "cell.stop";
constexpr std::size_t kStopLineBytesMax = 1500;  // an id has at most 1000

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

}  // namespace

/// One connection. Lives as long as an operation of its socket does.
class Session : public std::enable_shared_from_this<Session> {
 public:
  using OnSession = std::function<void(const std::shared_ptr<Session>&)>;

  /// `on_waiting`: a request waits, and serve_next() is to be called.
  Session(Stream::socket socket, Peer peer, const ServerLimits& limits, const Services& services, OnSession on_waiting,
          OnSession on_closed, TokenFailures& token_failures)
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
  bool may_serve() const { return unread_bytes() < limits_.unread_bytes && pending_replies_ < limits_.pending_replies; }
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
  std::optional<Peer> peer;
  if (token_failures_.may_try(address)) peer = services_.access.token_peer(token, address);
  if (peer) {
    peer_ = *peer;
    identify_timer_.cancel();
  } else {
    token_failures_.note(address);
    is_refused_ = true;
  }
  return peer;
}

void Session::read() {
  if (is_reading_ || is_at_end_ || is_closed_ || !may_serve()) return;
  if (waiting_bytes() >= chunk_.size() && line_end()) return;  // enough to serve
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
  const std::size_t from = inbox_.size();
  inbox_.append(chunk_.data(), count);
  serve_stops(from);
  go_on();
}

/// Among the lines that end after `from`.
void Session::serve_stops(std::size_t from) {
  for (auto end = inbox_.find('\n', from); end != std::string::npos; end = inbox_.find('\n', end + 1)) {
    const std::size_t begin = std::exchange(last_line_, end + 1);
    if (end - begin <= kStopLineBytesMax) serve_stop(begin, end);
  }
}

/// One at a time: further ones wait for their turn.
void Session::serve_stop(std::size_t begin, std::size_t end) {
  const std::string_view line(inbox_.data() + begin, end - begin);
  if (is_stop_pending_ || is_stranger() || line.find(kStop) == std::string_view::npos) return;
  const RpcMessage message = parse_rpc(line);
  const auto* request = std::get_if<RpcRequest>(&message.elements.front().content);
  if (message.is_batch || request == nullptr || request->method != kStop) return;
  std::fill_n(inbox_.begin() + static_cast<std::ptrdiff_t>(begin), end - begin, ' ');  // an empty line is passed over
  stop_end_ = end;
  are_requests_overtaken_ = true;
  is_stop_pending_ = !request->is_notification;
  const std::weak_ptr<Session> weak = weak_from_this();
  answer(message.elements.front(), [weak](const std::string& text) {
    if (const auto self = weak.lock()) {
      self->is_stop_pending_ = false;
      self->send(text);
    }
  });
}

/// The end of the first line that is not yet served, if it has come.
std::optional<std::size_t> Session::line_end() {
  searched_ = inbox_.find('\n', std::max(served_, searched_));
  if (searched_ != std::string::npos) return searched_;
  searched_ = inbox_.size();
  return std::nullopt;
}

/// As long as the client reads its answers; otherwise its requests wait, and nothing more is read.
void Session::ask_for_turn() {
  if (has_asked_ || is_closed_ || is_refused_ || !may_serve()) return;
  if (requests_.empty() && !line_end()) return;
  has_asked_ = true;
  on_waiting_(shared_from_this());
}

void Session::go_on() {
  if (is_closed_) return;
  if (is_refused_) {
    requests_.clear();
    inbox_.clear();
    served_ = searched_ = last_line_ = stop_end_ = 0;
    is_at_end_ = true;
  }
  refuse_long_line();
  ask_for_turn();
  close_if_done();
  read();
}

void Session::refuse_long_line() {
  const std::size_t end = line_end().value_or(inbox_.size());
  const std::size_t limit = line_bytes_max();
  if (is_refused_ || end - served_ <= limit) return;
  is_refused_ = true;
  send(rpc_fault(nullptr, {kRpcParse, "a message has at most " + std::to_string(limit) + " bytes", ""}));
  go_on();
}

void Session::serve_next() {
  has_asked_ = false;
  if (is_closed_ || is_refused_ || !may_serve()) return;
  if (requests_.empty()) take_line();
  if (!requests_.empty()) {
    const Waiting waiting = std::move(requests_.front());
    requests_.pop_front();
    if (const auto fault = refusal(waiting))
      refuse(waiting, *fault);
    else
      answer(waiting.element, waiting.send);
  }
  go_on();
}

std::optional<RpcFault> Session::refusal(const Waiting& waiting) const {
  if (is_overtaken(waiting.element))
    return RpcFault{kRpcWrongState, "a cell.stop that came after this request was served before it", ""};
  if (waiting.batch && waiting.batch->text.size() > limits_.batch_reply_bytes)
    return RpcFault{kRpcInvalidRequest, "the answers of this batch are too long: ask for less at once", ""};
  return std::nullopt;
}

/// A notification gets no answer, not even this one.
void Session::refuse(const Waiting& waiting, const RpcFault& fault) {
  const auto* request = std::get_if<RpcRequest>(&waiting.element.content);
  if (request == nullptr || !request->is_notification) waiting.send(rpc_fault(waiting.element.id, fault));
}

bool Session::is_overtaken(const RpcElement& element) const {
  const auto* request = std::get_if<RpcRequest>(&element.content);
  return are_requests_overtaken_ && request != nullptr && request->method != kStop &&
         services_.methods.is_act(request->method);
}

/// The next line that is not empty becomes requests.
void Session::take_line() {
  while (requests_.empty()) {
    const auto end = line_end();
    if (!end) break;
    are_requests_overtaken_ = served_ < stop_end_;
    queue_requests(std::string_view(inbox_.data() + served_, *end - served_));
    served_ = *end + 1;
  }
  if (served_ < inbox_.size() && served_ < chunk_.size()) return;  // moving the rest costs more than keeping it
  inbox_.erase(0, served_);
  for (std::size_t* place : {&searched_, &last_line_, &stop_end_}) *place -= std::min(*place, served_);
  served_ = 0;
}

void Session::queue_requests(std::string_view line) {
  if (line.find_first_not_of(" \t\r") == std::string_view::npos) return;
  RpcMessage message = parse_rpc(line);
  const std::weak_ptr<Session> weak = weak_from_this();
  if (!message.is_batch) {
    const auto send = [weak](const std::string& text) {
      if (const auto self = weak.lock()) self->send(text);
    };
    requests_.push_back({std::move(message.elements.front()), send, nullptr});
    return;
  }
  const auto batch = std::make_shared<Batch>();
  for (const auto& element : message.elements) {
    const auto* request = std::get_if<RpcRequest>(&element.content);
    if (request == nullptr || !request->is_notification) ++batch->awaited;
  }
  const auto send = [weak, batch](const std::string& text) {
    batch->text += (batch->text.empty() ? "[" : ",") + text;
    if (--batch->awaited > 0) return;
    if (const auto self = weak.lock()) self->send(batch->text + "]");
  };
  for (auto& element : message.elements) requests_.push_back({std::move(element), send, batch});
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
  if (is_remote() && is_stranger() && !services_.methods.is_open_to_strangers(request.method)) is_refused_ = true;
  if (request.is_notification)
    return services_.methods.dispatch(request, caller(), {[](const Json&) {}, [](const RpcFault&) {}});
  ++pending_replies_;
  const std::weak_ptr<Session> weak = weak_from_this();
  const auto finish = [weak, send = std::move(send)](const std::string& text) {
    if (const auto self = weak.lock()) {
      --self->pending_replies_;
      send(text);
      self->go_on();
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
                      self->go_on();
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
  const bool has_request = !requests_.empty() || line_end();
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
  TokenFailures token_failures;
  std::unordered_set<std::shared_ptr<Session>> sessions;
  std::deque<std::weak_ptr<Session>> strangers;  ///< the oldest first; some have got rights since, or are gone
  std::deque<std::weak_ptr<Session>> turns;      ///< sessions with a request that waits, each at most once

  Peer identify_peer(Local::socket& socket, const Services& services) { return peer_of(socket, services.access); }
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
    return static_cast<std::size_t>(
        std::count_if(sessions.begin(), sessions.end(), [](const auto& session) { return session->is_remote(); }));
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

  /// One request at each turn; between two turns everything is received that has come meanwhile, and its stops are
  /// served.
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
