#pragma once
#include <unistd.h>

#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <initializer_list>

/// What seeded campaigns share: settings from the environment, and the report of a crash.
namespace hilbrush::test {

/// The seed of the mutant that is being read, for the signal handler.
inline volatile std::uint64_t current_seed = 0;

inline void report_crash(int signal) {
  char text[120];
  const int length = std::snprintf(text, sizeof text, "signal %d while reading the mutant of seed %llu\n",
                                   signal, static_cast<unsigned long long>(current_seed));
  if (length > 0 && ::write(STDERR_FILENO, text, static_cast<std::size_t>(length)) < 0) ::_exit(3);
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

/// Crashes are reported while it lives.
class CrashReports {
 public:
  CrashReports() { handle(report_crash); }
  ~CrashReports() { handle(SIG_DFL); }
  CrashReports(const CrashReports&) = delete;
  CrashReports& operator=(const CrashReports&) = delete;

 private:
  static void handle(void (*handler)(int)) {
    for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGABRT, SIGALRM}) std::signal(signal, handler);
  }
};

inline std::uint64_t number_from_environment(const char* name, std::uint64_t otherwise) {
  const char* text = std::getenv(name);
  return text != nullptr ? std::strtoull(text, nullptr, 10) : otherwise;
}

}  // namespace hilbrush::test
