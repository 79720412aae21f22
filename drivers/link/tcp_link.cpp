#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <memory>

#include "drivers/link/link.h"

namespace hilbrush {
namespace {

class TcpLink final : public Link {
 public:
  TcpLink(int fd, std::string name) : Link(fd, std::move(name)) {}
  ~TcpLink() override { ::close(fd_); }
};

struct AddressList {
  addrinfo* first = nullptr;
  ~AddressList() {
    if (first != nullptr) ::freeaddrinfo(first);
  }
};

/// 0, or the errno of what went wrong.
int connect_by(int fd, const addrinfo& address, Deadline deadline) {
  if (::connect(fd, address.ai_addr, address.ai_addrlen) == 0) return 0;
  if (errno != EINPROGRESS) return errno;
  for (;;) {
    pollfd polled{fd, POLLOUT, 0};
    const auto left =
        std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now()).count();
    const int ready = ::poll(&polled, 1, static_cast<int>(std::clamp<long long>(left, 0, 3'600'000)));
    if (ready < 0 && errno == EINTR) continue;
    if (ready <= 0) return ready == 0 ? ETIMEDOUT : errno;
    int error = 0;
    socklen_t size = sizeof error;
    ::getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &size);
    return error;
  }
}

/// A peer that vanished without a word (power cut, cable) is noticed within seconds even on a link that only
/// listens.
void set_options(int fd) {
  const auto set = [fd](int level, int option, int value) {
    ::setsockopt(fd, level, option, &value, sizeof value);
  };
  set(IPPROTO_TCP, TCP_NODELAY, 1);
  set(SOL_SOCKET, SO_KEEPALIVE, 1);
  set(IPPROTO_TCP, TCP_KEEPIDLE, 2);
  set(IPPROTO_TCP, TCP_KEEPINTVL, 1);
  set(IPPROTO_TCP, TCP_KEEPCNT, 3);
}

}  // namespace

std::unique_ptr<Link> open_tcp_link(const std::string& host, std::uint16_t port, Deadline deadline) {
  const std::string name = host + ":" + std::to_string(port);
  addrinfo wanted{};
  wanted.ai_socktype = SOCK_STREAM;
  AddressList addresses;
  if (const int error = ::getaddrinfo(host.c_str(), std::to_string(port).c_str(), &wanted, &addresses.first))
    throw LinkError(name + ": " + ::gai_strerror(error));
  int error = EADDRNOTAVAIL;
  for (const addrinfo* address = addresses.first; address != nullptr; address = address->ai_next) {
    const int fd = ::socket(address->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (fd < 0) {
      error = errno;
      continue;
    }
    error = connect_by(fd, *address, deadline);
    if (error == 0) {
      set_options(fd);
      return std::make_unique<TcpLink>(fd, name);
    }
    ::close(fd);
  }
  throw LinkError(name + ": cannot be connected: " + std::strerror(error));
}

std::unique_ptr<Link> open_link(const std::string& port, int baud, Parity parity, Deadline deadline) {
  constexpr std::string_view kScheme = "tcp://";
  if (!port.starts_with(kScheme)) return open_serial_link(port, baud, parity);
  const std::size_t colon = port.rfind(':');
  std::uint16_t number = 0;
  const char* end = port.data() + port.size();
  const auto [rest, error] = std::from_chars(port.data() + colon + 1, end, number);
  if (colon < kScheme.size() || error != std::errc() || rest != end || number == 0)
    throw LinkError(port + ": not an address of the form tcp://HOST:PORT");
  return open_tcp_link(port.substr(kScheme.size(), colon - kScheme.size()), number, deadline);
}

}  // namespace hilbrush
