#include "sim/devices/sim_clock.h"

#include <limits>

namespace hilbrush {

double SimClock::now_s() const {
  return is_virtual() ? virtual_now_s_.load() : wall_.now_s() / time_scale_;
}

void SimClock::sleep_until(double time_s) {
  if (is_virtual()) {
    jump_to(time_s);
    return;
  }
  // A hair longer, so that the division in now_s() cannot round to just before time_s.
  constexpr double kRoundingAllowance = 1 + 4 * std::numeric_limits<double>::epsilon();
  wall_.sleep_until(time_s * time_scale_ * kRoundingAllowance);
}

void SimClock::wake() {
  if (!is_virtual()) wall_.wake();
}

void SimClock::jump_to(double time_s) {
  if (!is_virtual()) return;
  double now = virtual_now_s_.load();
  while (now < time_s && !virtual_now_s_.compare_exchange_weak(now, time_s)) {
  }
}

}  // namespace hilbrush
