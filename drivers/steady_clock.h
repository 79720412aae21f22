#pragma once
#include <chrono>
#include <condition_variable>
#include <mutex>

#include "drivers/clock.h"

namespace hilbrush {

/// Time since construction on the machine's monotonic clock.
class SteadyClock final : public Clock {
 public:
  /// `scale`: wall seconds of one cell second. 1 on every real cell; device servers whose time runs faster
  /// need the same scale on both sides. @pre scale > 0
  explicit SteadyClock(double scale = 1) : scale_(scale) {}

  double now_s() const override;
  void sleep_until(double time_s) override;
  void wake() override;
  double wall_s(double cell_s) const override { return cell_s * scale_; }

 private:
  using Steady = std::chrono::steady_clock;
  const double scale_;
  const Steady::time_point start_ = Steady::now();
  std::mutex mutex_;
  std::condition_variable woken_;
  bool is_wake_pending_ = false;
};

}  // namespace hilbrush
