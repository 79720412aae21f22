// hilbrushd: the daemon that owns the cell. See daemon/server/daemon.h; the operator's command is `hilbrush`.

#include <signal.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <string>

#include "daemon/server/daemon.h"
#include "sampling/base/check.h"
#include "sampling/base/input_error.h"

namespace {

using hilbrush::Daemon;
using hilbrush::DaemonOptions;

enum ExitCode { kOk = 0, kInternal = 1, kUsage = 2, kBadInput = 3 };

/// For a process that is about to abort: whatever has failed, the beam must be off.
std::atomic<Daemon*> g_daemon{nullptr};

void disarm() noexcept {
  if (Daemon* daemon = g_daemon.exchange(nullptr)) daemon->laser_off();
}

void disarm_and_abort(const std::string& message) {
  disarm();
  spdlog::critical("{}", message);
  std::abort();
}

void disarm_and_terminate() {
  disarm();
  spdlog::critical("an exception escaped");
  std::abort();
}

/// Beside this program, where both the build and the installation put it.
std::filesystem::path pipeline_beside_program() {
  std::error_code error;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", error);
  return error ? std::filesystem::path("hilbrush-pipeline") : self.parent_path() / "hilbrush-pipeline";
}

/// Many clients may stay connected.
void raise_descriptor_limit() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = std::min<rlim_t>(limit.rlim_max, 4096);
  ::setrlimit(RLIMIT_NOFILE, &limit);
}

int serve(const DaemonOptions& options) {
  hilbrush::set_check_handler(disarm_and_abort);
  std::set_terminate(disarm_and_terminate);
  Daemon daemon(options);
  g_daemon.store(&daemon);
  if (!daemon.notice().empty()) spdlog::warn("{}", daemon.notice());
  daemon.end_on_signals([] { ::sd_notify(0, "STOPPING=1"); });
  // The watchdog is fed from the thread that serves requests: a daemon that cannot receive a stop is ended.
  if (std::uint64_t period_us = 0; ::sd_watchdog_enabled(0, &period_us) > 0)
    daemon.every(static_cast<double>(period_us) / 2e6, [] { ::sd_notify(0, "WATCHDOG=1"); });
  const std::string tcp = daemon.tcp_address().empty() ? "" : " and " + daemon.tcp_address();
  spdlog::info("hilbrushd {} listens on {}{}; the cell is stopped", HILBRUSH_VERSION, options.socket.string(),
               tcp);
  ::sd_notify(0, "READY=1");
  daemon.run();
  disarm();
  spdlog::info("hilbrushd ends; the laser is off");
  return kOk;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "The daemon of a robot cell that paints with light: takes jobs over a Unix socket, plans them, paints "
      "them."};
  app.set_version_flag("--version", std::string("hilbrushd ") + HILBRUSH_VERSION);
  DaemonOptions options;
  options.socket = "/run/hilbrush/hilbrush.sock";
  options.state = "/var/lib/hilbrush";
  options.pipeline = pipeline_beside_program();
  std::string level = "info";
  std::string settings;
  app.add_option("--socket", options.socket, "Unix socket to listen on (mode 0660)")->capture_default_str();
  app.add_option("--state", options.state, "folder for jobs, their files and the audit log")
      ->capture_default_str();
  app.add_option("--settings", settings,
                 "JSON file: who may connect, TCP (default: the socket's group may, no TCP)");
  app.add_option("--cell", options.cell, "cell file, or name of a shipped cell")->capture_default_str();
  app.add_option("--time-scale", options.time_scale,
                 "wall seconds of one second of a simulated cell: 1 real time, 0 as fast as possible "
                 "(default: the cell file's)");
  app.add_option("--pipeline", options.pipeline, "the program hilbrush-pipeline")->capture_default_str();
  app.add_option("--pipeline-silence-s", options.pipeline_silence_s,
                 "a pipeline that makes no progress for this long is killed")
      ->check(CLI::Range(0.1, 86400.))
      ->capture_default_str();
  app.add_option("--pipeline-memory-mb", options.pipeline_memory_mb,
                 "a pipeline that needs more memory is killed")
      ->check(CLI::Range(1, 1 << 20))
      ->capture_default_str();
  app.add_option("--log-level", level, "debug, info, warn, error or off")
      ->check(CLI::IsMember({"debug", "info", "warn", "error", "off"}))
      ->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kOk : kUsage;
  }

  spdlog::set_default_logger(spdlog::stderr_color_mt("hilbrushd"));
  spdlog::set_level(spdlog::level::from_str(level));
  ::signal(SIGPIPE, SIG_IGN);
  ::signal(SIGHUP, SIG_IGN);   // a terminal that is closed must not end a painting job
  ::umask(::umask(0) | 0027);  // jobs and the audit log are for the daemon's user and group only
  ::signal(SIGXFSZ,
           SIG_IGN);  // a file that must not grow is an error of the write, and does not end the daemon
  raise_descriptor_limit();
  try {
    if (!settings.empty()) options.settings = hilbrush::load_daemon_settings(settings);
    return serve(options);
  } catch (const hilbrush::InputError& error) {
    spdlog::error("{}", error.what());
    return kBadInput;
  } catch (const std::exception& error) {
    spdlog::error("{}", error.what());
    return kInternal;
  }
}
