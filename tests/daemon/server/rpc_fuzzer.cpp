// libFuzzer target: whole conversations with a daemon. Each input is what one client sends before it ends its
// side; the daemon must answer, close, and go on. The cell is the simulated one, the pipeline a program that
// fails at once.
//   rpc_fuzzer -max_total_time=600 -max_len=4096 tests/fuzz/corpus/rpc

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <thread>

#include "daemon/server/daemon.h"
#include "tests/support/temporary_folder.h"

namespace {

using hilbrush::Daemon;
using hilbrush::DaemonOptions;

class World {
 public:
  World() : daemon_(options()), thread_([this] { daemon_.run(); }) {}
  ~World() {
    daemon_.end();
    thread_.join();
  }

  void converse(const std::uint8_t* bytes, std::size_t count) {
    const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, (folder_ / "socket").c_str(), sizeof address.sun_path - 1);
    if (::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
      std::cerr << "the daemon is gone: " << std::strerror(errno) << "\n";
      std::abort();
    }
    // The answers are small beside the socket's buffer, so sending everything first does not block.
    for (std::size_t sent = 0; sent < count;) {
      const ssize_t now = ::send(fd, bytes + sent, count - sent, MSG_NOSIGNAL);
      if (now <= 0) break;
      sent += static_cast<std::size_t>(now);
    }
    ::shutdown(fd, SHUT_WR);
    char chunk[4096];
    while (::recv(fd, chunk, sizeof chunk, 0) > 0) {
    }
    ::close(fd);
  }

 private:
  DaemonOptions options() const {
    DaemonOptions options;
    options.socket = folder_ / "socket";
    options.state = folder_ / "state";
    options.time_scale = 0;
    options.pipeline = "/bin/false";
    return options;
  }

  hilbrush::testing_support::TemporaryFolder folder_;
  Daemon daemon_;
  std::thread thread_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t count) {
  static World world;
  world.converse(bytes, count);
  return 0;
}
