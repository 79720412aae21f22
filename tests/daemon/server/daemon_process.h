#pragma once
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/daemon/server/daemon_fixture.h"

extern char** environ;

namespace hilbrush::test {

/// The program hilbrushd in a process of its own, which can be killed as no daemon in this process could.
class DaemonProcess {
 public:
  /// `environment`: NAME=value, on top of this process's own.
  explicit DaemonProcess(const DaemonOptions& options, std::vector<std::string> environment = {}) {
    const std::string program = std::string(HILBRUSH_BUILD_DIR) + "/hilbrushd";
    std::vector<std::string> arguments{program,
                                       "--socket",
                                       options.socket.string(),
                                       "--state",
                                       options.state.string(),
                                       "--cell",
                                       options.cell,
                                       "--pipeline",
                                       options.pipeline.string(),
                                       "--log-level",
                                       "off"};
    if (options.time_scale)
      arguments.insert(arguments.end(), {"--time-scale", std::to_string(*options.time_scale)});
    std::vector<char*> argv;
    for (auto& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    std::vector<char*> envp;
    for (auto& variable : environment) envp.push_back(variable.data());
    for (char** variable = environ; *variable != nullptr; ++variable) envp.push_back(*variable);
    envp.push_back(nullptr);
    EXPECT_EQ(::posix_spawn(&pid_, program.c_str(), nullptr, nullptr, argv.data(), envp.data()), 0);
  }
  ~DaemonProcess() { end(SIGKILL); }
  DaemonProcess(const DaemonProcess&) = delete;
  DaemonProcess& operator=(const DaemonProcess&) = delete;

  pid_t pid() const { return pid_; }
  /// The exit code, or minus the signal's number.
  int end(int signal) {
    if (pid_ <= 0) return 0;
    ::kill(pid_, signal);
    int status = 0;
    ::waitpid(std::exchange(pid_, -1), &status, 0);
    return WIFSIGNALED(status) ? -WTERMSIG(status) : WEXITSTATUS(status);
  }

 private:
  pid_t pid_ = -1;
};

/// Tries every 5 ms.
inline std::unique_ptr<LineClient> connect(const DaemonOptions& options, int attempts = 2000) {
  for (int attempt = 0; attempt < attempts; ++attempt) {
    try {
      return std::make_unique<LineClient>(options.socket);
    } catch (const std::runtime_error&) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }
  throw std::runtime_error("hilbrushd does not come up");
}

inline bool is_built() {
  return ::access((std::string(HILBRUSH_BUILD_DIR) + "/hilbrushd").c_str(), X_OK) == 0;
}

}  // namespace hilbrush::test
