// hilbrush-laserguard: owns a laser's link, so that the laser is turned off whatever happens to the process
// that uses it. See drivers/guard/guard_server.h. Started by hilbrushd, never by hand: its user's channel is
// descriptor 3.

#include <sched.h>
#include <signal.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>
#include <string_view>

#include "drivers/guard/guard_process.h"
#include "drivers/guard/guard_server.h"
#include "drivers/laser/cobolt_head.h"
#include "drivers/laser/obis_head.h"
#include "drivers/steady_clock.h"

namespace {

using namespace hilbrush;

enum ExitCode { kOk = 0, kFailed = 1, kUsage = 2, kStillOn = 3 };

/// For a process that crashes: the raw link, and the commands that turn the laser off, of both laser heads.
std::atomic<const LineLaser*> g_laser{nullptr};
constexpr std::string_view kOffCommands = "\r\nSOUR:AM:STAT OFF\r\n!d\rl0\r";

/// Calls only what is safe in a signal handler. A laser refuses the command of the other one.
void turn_laser_off(int signal) {
  if (const LineLaser* laser = g_laser.load())
    if (const int fd = laser->descriptor(); fd >= 0) {
      [[maybe_unused]] const ssize_t written = ::write(fd, kOffCommands.data(), kOffCommands.size());
    }
  ::signal(signal, SIG_DFL);
  ::raise(signal);
}

/// Signals that mean "end" are read from a descriptor; those that mean "crashed" turn the laser off at once.
int catch_signals() {
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGSYS, SIGTRAP, SIGXCPU, SIGXFSZ})
    ::signal(signal, turn_laser_off);
  ::signal(SIGPIPE, SIG_IGN);
  sigset_t set;
  ::sigemptyset(&set);
  for (const int signal : {SIGTERM, SIGINT, SIGHUP, SIGQUIT, SIGUSR1, SIGUSR2, SIGALRM, SIGVTALRM, SIGPROF,
                           SIGPWR, SIGIO, SIGSTKFLT, SIGTSTP, SIGTTIN, SIGTTOU})
    ::sigaddset(&set, signal);
  for (int signal = SIGRTMIN; signal <= SIGRTMAX; ++signal) ::sigaddset(&set, signal);
  ::sigprocmask(SIG_BLOCK, &set, nullptr);
  return ::signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK);
}

/// Heartbeats and pulses are timed to the millisecond: where the system allows it, before all ordinary
/// processes.
void take_precedence() {
  constexpr int kPriority = 10;
  const sched_param parameters{kPriority};
  ::sched_setscheduler(0, SCHED_FIFO, &parameters);
}

int serve(const GuardArguments& arguments, int signals) {
  SteadyClock clock(arguments.time_scale);
  std::unique_ptr<LineLaser> head;
  std::unique_ptr<CoboltGate> gate;
  if (arguments.driver == "cobolt") {
    auto cobolt = std::make_unique<CoboltHead>(arguments.laser, !arguments.has_own_gate, clock);
    if (arguments.has_own_gate) gate = std::make_unique<CoboltGate>(*cobolt, clock);
    head = std::move(cobolt);
  } else {
    head = std::make_unique<ObisHead>(arguments.laser, clock);
  }
  g_laser = head.get();
  int exit_code = kStillOn;
  {
    GuardServer server(*head, gate.get(), GuardProcess::kChannel, signals,
                       {arguments.laser.heartbeat_s, arguments.laser.heartbeats_missed}, clock);
    const GuardServer::End end = server.run();
    if (!server.is_disarmed())
      std::fputs("hilbrush-laserguard: THE LASER DOES NOT CONFIRM THAT IT IS OFF\n", stderr);
    else
      exit_code = end == GuardServer::End::kGarbage ? kFailed : kOk;
  }
  g_laser = nullptr;
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + (argc > 0 ? 1 : 0), argv + argc);
  if (words.size() == 1 && words[0] == "--version") {
    std::puts("hilbrush-laserguard " HILBRUSH_VERSION);
    return kOk;
  }
  try {
    const GuardArguments arguments = from_command_line(words);
    take_precedence();
    return serve(arguments, catch_signals());
  } catch (const DriverError& error) {
    std::fprintf(stderr, "hilbrush-laserguard: %s\n", error.what());
    return kUsage;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "hilbrush-laserguard: %s\n", error.what());
    return kFailed;
  }
}
