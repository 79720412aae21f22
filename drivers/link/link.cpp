#include "drivers/link/link.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>

namespace hilbrush {
namespace {

using Steady = std::chrono::steady_clock;

/// A hang-up on a socket must not become a signal; plain descriptors know no flags.
ssize_t write_quietly(int fd, std::string_view bytes) {
  const ssize_t sent = ::send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  return sent < 0 && errno == ENOTSOCK ? ::write(fd, bytes.data(), bytes.size()) : sent;
}

}  // namespace

Deadline deadline_in(double wall_s) {
  return Steady::now() +
         std::chrono::ceil<Steady::duration>(std::chrono::duration<double>(std::min(wall_s, 3600.)));
}

int milliseconds_until(Deadline deadline) {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Steady::now()).count();
  return static_cast<int>(std::clamp<long long>(left, 0, 3'600'000));
}

Link::Link(int fd, std::string name) : fd_(fd), name_(std::move(name)) {
  interrupt_fd_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (interrupt_fd_ < 0) lost(std::strerror(errno));
}

Link::~Link() {
  if (interrupt_fd_ >= 0) ::close(interrupt_fd_);
}

void Link::lost(const std::string& what) const {
  throw LinkError(name_ + ": " + what + messages_.text());
}

void Link::interrupt() noexcept {
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = ::write(interrupt_fd_, &one, sizeof one);
}

bool Link::wait_for(short events, Deadline deadline) {
  for (;;) {
    std::array<pollfd, 2> polled{pollfd{fd_, events, 0}, pollfd{interrupt_fd_, POLLIN, 0}};
    const int ready = ::poll(polled.data(), polled.size(), milliseconds_until(deadline));
    if (ready < 0 && errno == EINTR) continue;
    if (ready < 0) lost(std::strerror(errno));
    if (polled[1].revents != 0) lost("the link was closed");
    // What arrived before a hang-up is still read: the read that finds nothing more reports the hang-up.
    if (polled[0].revents != 0) return true;
    if (Steady::now() >= deadline) return false;
  }
}

void Link::write(std::string_view bytes, Deadline deadline) {
  messages_.sent(bytes);
  while (!bytes.empty()) {
    if (!wait_for(POLLOUT, deadline)) lost("takes no more bytes");
    const ssize_t written = write_quietly(fd_, bytes);
    if (written >= 0)
      bytes.remove_prefix(static_cast<std::size_t>(written));
    else if (errno == EPIPE || errno == ECONNRESET || errno == EIO)
      lost("the device hung up");
    else if (errno != EAGAIN && errno != EINTR)
      lost(std::strerror(errno));
  }
}

std::size_t Link::read(char* bytes, std::size_t size, Deadline deadline) {
  for (;;) {
    if (!wait_for(POLLIN, deadline)) return 0;
    const ssize_t got = ::read(fd_, bytes, size);
    if (got > 0) return static_cast<std::size_t>(got);
    if (got == 0 || errno == ECONNRESET || errno == EIO || errno == ENXIO) lost("the device hung up");
    if (errno != EAGAIN && errno != EINTR) lost(std::strerror(errno));
  }
}

void Link::discard_input() {
  std::array<char, 1024> rest{};
  while (read(rest.data(), rest.size(), Steady::now()) > 0) {
  }
}

std::string LineReader::read_line(Link& link, Deadline deadline) {
  for (;;) {
    const std::size_t start = buffer_.find_first_not_of("\r\n");
    const std::size_t end = start == std::string::npos ? start : buffer_.find_first_of("\r\n", start);
    if (end != std::string::npos) {
      std::string line = buffer_.substr(start, end - start);
      buffer_.erase(0, end + 1);
      if (line.size() > kLineMax) break;
      link.messages().received(line);
      return line;
    }
    if (buffer_.size() > kLineMax) break;
    std::array<char, 256> bytes{};
    const std::size_t got = link.read(bytes.data(), bytes.size(), deadline);
    if (got == 0) {
      if (!buffer_.empty()) link.messages().received(buffer_);
      const char* what = buffer_.empty() ? "no answer" : "an answer that breaks off";
      buffer_.clear();
      throw LinkError(link.name() + ": " + what + link.messages().text());
    }
    buffer_.append(bytes.data(), got);
  }
  link.messages().received(buffer_);
  buffer_.clear();
  throw LinkError(link.name() + ": an endless line" + link.messages().text());
}

}  // namespace hilbrush
