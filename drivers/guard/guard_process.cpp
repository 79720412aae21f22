#include "drivers/guard/guard_process.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <thread>

#include "drivers/driver_error.h"
#include "drivers/link/line_codec.h"
#include "drivers/number_text.h"

extern char** environ;

namespace hilbrush {

GuardProcess::~GuardProcess() {
  wait_for_end();
}

void GuardProcess::wait_for_end() noexcept {
  if (pid_ < 0) return;
  for (int i = 0; i < 200; ++i) {
    if (::waitpid(pid_, nullptr, WNOHANG) != 0) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  pid_ = -1;
}

int GuardProcess::start(const std::string& program, const std::vector<std::string>& arguments) {
  wait_for_end();
  int pair[2];
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, pair) != 0)
    throw DriverError(std::string("no channel to the laser's guard: ") + std::strerror(errno));
  std::vector<std::string> words{program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);

  // dup2 onto itself would leave close-on-exec set, so the guard's end goes through a number that is not
  // kChannel.
  const int theirs = ::fcntl(pair[1], F_DUPFD_CLOEXEC, kChannel + 1);
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  ::posix_spawn_file_actions_addopen(&actions, 1, "/dev/null", O_WRONLY, 0);
  ::posix_spawn_file_actions_adddup2(&actions, theirs, kChannel);
  ::posix_spawn_file_actions_addclosefrom_np(&actions, kChannel + 1);
  posix_spawnattr_t attributes;
  ::posix_spawnattr_init(&attributes);
  // Ctrl-C at the terminal is the user's to handle; the guard ends with its user.
  ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  const int error = ::posix_spawn(&pid_, program.c_str(), &actions, &attributes, argv.data(), environ);
  ::posix_spawnattr_destroy(&attributes);
  ::posix_spawn_file_actions_destroy(&actions);
  ::close(theirs);
  ::close(pair[1]);
  if (error == 0) return pair[0];
  ::close(pair[0]);
  pid_ = -1;
  throw DriverError("the laser's guard " + program + " cannot be started: " + std::strerror(error));
}

std::vector<std::string> to_command_line(const GuardArguments& arguments) {
  const LaserOptions& laser = arguments.laser;
  return {"--driver",
          arguments.driver,
          "--gate",
          arguments.has_own_gate ? "own" : "wired",
          "--port",
          laser.port,
          "--baud",
          std::to_string(laser.baud),
          "--arm-timeout-s",
          exact_text(laser.arm_timeout_s),
          "--command-gap-s",
          exact_text(laser.command_gap_s),
          "--heartbeat-s",
          exact_text(laser.heartbeat_s),
          "--heartbeats-missed",
          std::to_string(laser.heartbeats_missed),
          "--time-scale",
          exact_text(arguments.time_scale)};
}

GuardArguments from_command_line(const std::vector<std::string>& words) {
  GuardArguments arguments;
  LaserOptions& laser = arguments.laser;
  for (std::size_t i = 0; i < words.size(); i += 2) {
    const std::string& key = words[i];
    if (i + 1 == words.size()) throw DriverError(key + " needs a value");
    const std::string& value = words[i + 1];
    const auto number = [&](double min, double max) {
      const auto found = line_codec::decode_number(value);
      if (!found || *found < min || *found > max) throw DriverError(key + " cannot be " + value);
      return *found;
    };
    const auto one_of = [&](const char* first, const char* second) {
      if (value != first && value != second) throw DriverError(key + " cannot be " + value);
      return value == first;
    };
    if (key == "--driver")
      arguments.driver = one_of("obis", "cobolt") ? "obis" : "cobolt";
    else if (key == "--gate")
      arguments.has_own_gate = one_of("own", "wired");
    else if (key == "--port")
      laser.port = value;
    else if (key == "--baud")
      laser.baud = static_cast<int>(number(1200, 1e6));
    else if (key == "--arm-timeout-s")
      laser.arm_timeout_s = number(1, 3600);
    else if (key == "--command-gap-s")
      laser.command_gap_s = number(0, 10);
    else if (key == "--heartbeat-s")
      laser.heartbeat_s = number(0.001, 1);
    else if (key == "--heartbeats-missed")
      laser.heartbeats_missed = static_cast<int>(number(1, 100));
    else if (key == "--time-scale")
      arguments.time_scale = number(1e-4, 1e3);
    else
      throw DriverError("unknown option " + key);
  }
  if (laser.port.empty()) throw DriverError("--port is missing");
  if (arguments.has_own_gate && arguments.driver != "cobolt")
    throw DriverError("a laser of driver " + arguments.driver + " has no gate of its own");
  return arguments;
}

}  // namespace hilbrush
