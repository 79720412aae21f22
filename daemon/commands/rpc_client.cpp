#include "daemon/commands/rpc_client.h"

#include <fcntl.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <system_error>
#include <thread>
#include <utility>

namespace hilbrush {
namespace {

using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

constexpr const char* kTcp = "tcp://";

std::string system_message(int error) {
  return std::generic_category().message(error);
}

/// Waits until the descriptor is ready for `events`; false at the deadline.
bool wait_for(int descriptor, short events, Clock::time_point deadline) {
  while (true) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now()).count();
    pollfd entry{descriptor, events, 0};
    const int ready = poll(&entry, 1, static_cast<int>(std::clamp<long long>(left, 0, 1 << 30)));
    if (ready > 0) return true;
    if (ready == 0 && left <= 0) return false;
    if (ready < 0 && errno != EINTR)
      throw ConnectionError("the connection cannot be waited for: " + system_message(errno));
  }
}

std::string text_of(const Json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
}

[[noreturn]] void throw_refusal(const Json& error) {
  if (!error.is_object() || !error.contains("code") || !error["code"].is_number_integer())
    throw ConnectionError("the daemon answered with an error that is not a JSON-RPC error");
  const auto data = error.find("data");
  const std::string at = data != error.end() && data->is_object() ? text_of(*data, "at") : std::string();
  const std::string message = text_of(error, "message");
  throw RpcRefusal(error["code"].get<int>(), message.empty() ? "refused without a reason" : message, at);
}

}  // namespace

RpcClient::RpcClient(std::string socket_path, Milliseconds timeout)
    : path_(std::move(socket_path)), timeout_(timeout) {
  try {
    if (path_.starts_with(kTcp))
      connect_tcp(Clock::now() + timeout_);
    else
      connect_until(Clock::now() + timeout_);
  } catch (...) {
    if (descriptor_ >= 0) close(descriptor_);
    throw;
  }
}

RpcClient::~RpcClient() {
  close(descriptor_);
}

void RpcClient::connect_tcp(Deadline deadline) {
  const std::string endpoint = path_.substr(std::strlen(kTcp));
  const auto colon = endpoint.rfind(':');
  if (colon == std::string::npos) throw ConnectionError(path_ + ": expected tcp://HOST:PORT");
  const char* token = std::getenv("HILBRUSH_TOKEN");
  if (token == nullptr || *token == '\0')
    throw ConnectionError(path_ + " needs a token: put it into the environment variable HILBRUSH_TOKEN");
  addrinfo hints{};
  addrinfo* found = nullptr;
  hints.ai_socktype = SOCK_STREAM;
  if (const int error =
          getaddrinfo(endpoint.substr(0, colon).c_str(), endpoint.substr(colon + 1).c_str(), &hints, &found))
    throw ConnectionError(path_ + ": " + gai_strerror(error));
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> addresses(found, &freeaddrinfo);
  int error = ECONNREFUSED;
  for (const addrinfo* address = found; address != nullptr; address = address->ai_next) {
    descriptor_ = socket(address->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (descriptor_ < 0) throw ConnectionError("no socket can be made: " + system_message(errno));
    error = connect(descriptor_, address->ai_addr, address->ai_addrlen) == 0 ? 0 : errno;
    if (error == EINPROGRESS) {
      socklen_t length = sizeof error;
      if (!wait_for(descriptor_, POLLOUT, deadline))
        error = ETIMEDOUT;
      else
        getsockopt(descriptor_, SOL_SOCKET, SO_ERROR, &error, &length);
    }
    if (error == 0) break;
    close(std::exchange(descriptor_, -1));
  }
  if (error != 0) throw ConnectionError("no daemon answers on " + path_ + ": " + system_message(error));
  call("session.open", Json{{"token", token}});
}

void RpcClient::connect_until(Deadline deadline) {
  descriptor_ = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (descriptor_ < 0) throw ConnectionError("no socket can be made: " + system_message(errno));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path_.empty() || path_.size() >= sizeof(address.sun_path))
    throw ConnectionError("the socket's path must have 1 to " + std::to_string(sizeof(address.sun_path) - 1) +
                          " bytes: " + path_);
  std::memcpy(address.sun_path, path_.data(), path_.size());

  while (connect(descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    const int error = errno;
    if (error == EINTR) continue;
    // EAGAIN: the daemon's queue of new connections is full; connect() on a Unix socket does not wait for it.
    if (error == EAGAIN && Clock::now() < deadline) {
      std::this_thread::sleep_for(Milliseconds(5));
      continue;
    }
    if (error == EACCES || error == EPERM)
      throw ConnectionError("you may not use " + path_ + ": it is for the members of the daemon's group");
    std::string sentence = "no daemon answers on " + path_ + ": is hilbrushd running?";
    if (error != ENOENT && error != ECONNREFUSED) sentence += " (" + system_message(error) + ")";
    throw ConnectionError(sentence);
  }
}

void RpcClient::send_line(const std::string& line, Deadline deadline) {
  for (std::size_t sent = 0; sent < line.size();) {
    const ssize_t count = send(descriptor_, line.data() + sent, line.size() - sent, MSG_NOSIGNAL);
    if (count > 0) {
      sent += static_cast<std::size_t>(count);
    } else if (errno == EAGAIN) {
      if (!wait_for(descriptor_, POLLOUT, deadline))
        throw ConnectionError("the daemon on " + path_ + " does not listen");
    } else if (errno != EINTR) {
      throw ConnectionError("the daemon closed the connection");
    }
  }
}

std::optional<std::string> RpcClient::read_line(Deadline deadline) {
  while (true) {
    if (const std::size_t end = buffer_.find('\n', searched_); end != std::string::npos) {
      std::string line = buffer_.substr(0, end);
      buffer_.erase(0, end + 1);
      searched_ = 0;
      return line;
    }
    searched_ = buffer_.size();
    if (buffer_.size() > kLineBytesMax)
      throw ConnectionError("the daemon's answer is longer than any answer should be");

    std::array<char, 65536> block;
    const ssize_t count = recv(descriptor_, block.data(), block.size(), 0);
    if (count > 0) {
      buffer_.append(block.data(), static_cast<std::size_t>(count));
    } else if (count == 0 || (errno != EAGAIN && errno != EINTR)) {
      throw ConnectionError(buffer_.empty() ? "the daemon closed the connection"
                                            : "the daemon closed the connection in the middle of a message");
    } else if (errno == EAGAIN && !wait_for(descriptor_, POLLIN, deadline)) {
      return std::nullopt;
    }
  }
}

std::optional<Json> RpcClient::read_message(Deadline deadline) {
  const std::optional<std::string> line = read_line(deadline);
  if (!line) return std::nullopt;
  Json message = Json::parse(*line, nullptr, false);
  if (!message.is_object() || text_of(message, "jsonrpc") != "2.0")
    throw ConnectionError("what answers on " + path_ + " does not speak JSON-RPC 2.0");
  return message;
}

void RpcClient::keep(const Json& notification) {
  if (notifications_.size() >= kNotificationsMax) notifications_.pop_front();
  notifications_.push_back({text_of(notification, "method"), notification.value("params", Json())});
}

Json RpcClient::call(const std::string& method, const Json& params, std::optional<Milliseconds> timeout) {
  const Deadline deadline = Clock::now() + timeout.value_or(timeout_);
  const long id = next_id_++;
  Json request{{"jsonrpc", "2.0"}, {"id", id}, {"method", method}};
  if (!params.is_null()) request["params"] = params;
  send_line(request.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n", deadline);

  while (std::optional<Json> message = read_message(deadline)) {
    if (message->contains("method")) {
      keep(*message);
      continue;
    }
    // The daemon answers without an id if it could not read the line as a request.
    const Json answered = message->value("id", Json());
    const bool has_error = message->contains("error");
    if (answered != id && !(answered.is_null() && has_error))
      throw ConnectionError("the daemon answered a request that was not made");
    if (has_error) throw_refusal((*message)["error"]);
    if (!message->contains("result"))
      throw ConnectionError("the daemon's answer has neither result nor error");
    return (*message)["result"];
  }
  throw ConnectionError("the daemon on " + path_ + " did not answer " + method + " in " +
                        std::to_string(timeout.value_or(timeout_).count()) + " ms");
}

std::optional<RpcClient::Notification> RpcClient::next_notification(Milliseconds timeout) {
  const Deadline deadline = Clock::now() + timeout;
  while (notifications_.empty()) {
    const std::optional<Json> message = read_message(deadline);
    if (!message) return std::nullopt;
    if (message->contains("method")) keep(*message);
  }
  Notification first = std::move(notifications_.front());
  notifications_.pop_front();
  return first;
}

}  // namespace hilbrush
