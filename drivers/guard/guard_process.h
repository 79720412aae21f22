#pragma once
#include <string>
#include <vector>

#include "drivers/device_options.h"

namespace hilbrush {

/// A hilbrush-laserguard process and this side's end of its channel. When the channel is closed the guard
/// disarms the laser and ends by itself; the destructor waits for that, for a bounded time, and leaves a
/// guard that is still busy disarming alone.
class GuardProcess {
 public:
  GuardProcess() = default;
  ~GuardProcess();
  GuardProcess(const GuardProcess&) = delete;
  GuardProcess& operator=(const GuardProcess&) = delete;

  /// Starts `program`; its channel is its descriptor kChannel, all others but standard error are closed to
  /// it.
  /// @return this side's end, owned by the caller. @throws DriverError
  int start(const std::string& program, const std::vector<std::string>& arguments);
  int pid() const { return pid_; }

  static constexpr int kChannel = 3;

 private:
  void wait_for_end() noexcept;
  int pid_ = -1;
};

/// A guard's command line.
struct GuardArguments {
  std::string driver = "obis";  ///< or "cobolt"
  bool has_own_gate = false;
  LaserOptions laser;
  double time_scale = 1;
};
std::vector<std::string> to_command_line(const GuardArguments& arguments);
/// `arguments` without the program's name. @throws DriverError with a sentence
GuardArguments from_command_line(const std::vector<std::string>& arguments);

}  // namespace hilbrush
