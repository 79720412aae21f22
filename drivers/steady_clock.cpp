#include "drivers/steady_clock.h"

#include <algorithm>

namespace hilbrush {

double SteadyClock::now_s() const {
  return std::chrono::duration<double>(Steady::now() - start_).count() / scale_;
}

void SteadyClock::sleep_until(double time_s) {
  // One wait of at most an hour at a time: a time_point far in the future would overflow the clock's integer
  // nanoseconds.
  constexpr double kMaxWaitS = 3600;
  std::unique_lock lock(mutex_);
  while (!is_wake_pending_) {
    const double remaining_s = time_s - now_s();
    if (!(remaining_s > 0)) return;
    const auto wait = std::chrono::duration<double>(std::min(remaining_s * scale_, kMaxWaitS));
    woken_.wait_for(lock, std::chrono::ceil<Steady::duration>(wait), [this] { return is_wake_pending_; });
  }
  is_wake_pending_ = false;
}

void SteadyClock::wake() {
  {
    const std::lock_guard lock(mutex_);
    is_wake_pending_ = true;
  }
  woken_.notify_all();
}

}  // namespace hilbrush
