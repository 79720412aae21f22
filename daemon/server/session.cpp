#include "daemon/server/session.h"

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/write.hpp>
#include <cstring>
#include <vector>

namespace hilbrush {
namespace {

constexpr const char* kStop = "cell.stop";
constexpr std::size_t kStopLineBytesMax = 1500;  // an id has at most 1000

}  // namespace

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
  socket_.async_read_some(
      asio::buffer(chunk_),
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
  std::fill_n(inbox_.begin() + static_cast<std::ptrdiff_t>(begin), end - begin,
              ' ');  // an empty line is passed over
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
  if (served_ < inbox_.size() && served_ < chunk_.size())
    return;  // moving the rest costs more than keeping it
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
  if (is_remote() && is_stranger() && !services_.methods.is_open_to_strangers(request.method))
    is_refused_ = true;
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
  services_.methods.dispatch(
      request, caller(),
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

/// Updates are sent when nothing else waits to be read, each with the state at that moment: a slow client
/// gets fewer of them, never a queue.
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
  if (is_at_end_ && !is_closed_ && !has_request && pending_replies_ == 0 && outbox_.empty() && !is_writing_)
    close();
}

void Session::close() {
  if (std::exchange(is_closed_, true)) return;
  boost::system::error_code ignored;
  socket_.close(ignored);
  on_closed_(shared_from_this());
}

}  // namespace hilbrush
