#pragma once
#include <chrono>
#include <condition_variable>
#include <mutex>

#include "drivers/clock.h"

namespace hilbrush {

/// Real time: seconds since construction on the machine's monotonic clock.
class SteadyClock final : public Clock {
 public:
  double now_s() const override;
  void sleep_until(double time_s) override;
  void wake() override;

 private:
  using Steady = std::chrono::steady_clock;
  const Steady::time_point start_ = Steady::now();
  std::mutex mutex_;
  std::condition_variable woken_;
  bool is_wake_pending_ = false;
};

}  // namespace hilbrush
