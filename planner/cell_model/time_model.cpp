#include "planner/cell_model/time_model.h"

#include <algorithm>
#include <cmath>

namespace hilbrush {

double trapezoid_s(double distance, double speed_max, double acceleration_max) {
  const double ramps_m = speed_max * speed_max / acceleration_max;  // the length of both ramps together
  if (distance <= ramps_m) return 2 * std::sqrt(distance / acceleration_max);
  return distance / speed_max + speed_max / acceleration_max;
}

double move_s(const CellDescription& cell, const Joints& from, const Joints& to) {
  double slowest_s = 0;
  for (std::size_t i = 0; i < kAxisCount; ++i)
    slowest_s =
        std::max(slowest_s, cell.axes[i].time_factor * trapezoid_s(std::abs(to[i] - from[i]), cell.axes[i].speed_max,
                                                                   cell.axes[i].acceleration_max));
  const double tick_s = cell.timing.tick_s;
  if (tick_s <= 0) return slowest_s;
  // A move that ends exactly on a tick must not cost another one by rounding.
  return std::ceil(slowest_s / tick_s - 1e-9) * tick_s;
}

double settle_s(const CellDescription& cell, const Joints& from, const Joints& to) {
  double share = 0;
  for (std::size_t i = 0; i < kAxisCount; ++i)
    if (cell.axes[i].settle_saturation > 0)
      share = std::max(share, std::abs(to[i] - from[i]) / cell.axes[i].settle_saturation);
  const auto& timing = cell.timing;
  return timing.settle_min_s + (timing.settle_max_s - timing.settle_min_s) * std::min(1., share);
}

double step_s(const CellDescription& cell, const Joints& from, const Joints& to) {
  return move_s(cell, from, to) + settle_s(cell, from, to);
}

}  // namespace hilbrush
