#pragma once
#include <atomic>

#include "drivers/steady_clock.h"

namespace hilbrush {

/// The simulated cell's time. time_scale wall seconds make one cell second; 0 is virtual time, which stands
/// still until a thread sleeps and then jumps to the end of the sleep: right for one executor thread, whose
/// sleeps are then all that takes time.
class SimClock final : public Clock {
 public:
  explicit SimClock(double time_scale) : time_scale_(time_scale) {}

  double now_s() const override;
  void sleep_until(double time_s) override;
  void wake() override;

  bool is_virtual() const { return time_scale_ <= 0; }
  double wall_s(double cell_s) const override { return is_virtual() ? 0 : cell_s * time_scale_; }
  /// Virtual time jumps forward to time_s (never back); scaled time passes by itself. From any thread.
  void jump_to(double time_s);

 private:
  const double time_scale_;
  SteadyClock wall_;
  std::atomic<double> virtual_now_s_{0};
};

}  // namespace hilbrush
