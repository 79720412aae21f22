#include "planner/cell_model/time_model.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hilbrush {

double trapezoid_s(double distance, double speed_max, double acceleration_max) {
  const double ramps_m = speed_max * speed_max / acceleration_max;  // the length of both ramps together
  if (distance <= ramps_m) return 2 * std::sqrt(distance / acceleration_max);
  return distance / speed_max + speed_max / acceleration_max;
}

double trapezoid_position(double distance, double speed_max, double acceleration_max, double time_s) {
  if (time_s <= 0) return 0;
  const double whole_s = trapezoid_s(distance, speed_max, acceleration_max);
  if (time_s >= whole_s) return distance;
  const double ramp_s = std::min(speed_max / acceleration_max, whole_s / 2);
  if (time_s <= ramp_s) return .5 * acceleration_max * time_s * time_s;
  if (time_s >= whole_s - ramp_s)
    return distance - .5 * acceleration_max * (whole_s - time_s) * (whole_s - time_s);
  return .5 * acceleration_max * ramp_s * ramp_s + speed_max * (time_s - ramp_s);
}

namespace {

/// The law that all joints of a coordinated chain share: the move is 1 long.
struct SharedLaw {
  double speed_max = std::numeric_limits<double>::infinity();
  double acceleration_max = std::numeric_limits<double>::infinity();
  double time_factor = 1;
  bool is_move = false;
};

SharedLaw shared_law(const CellDescription& cell, Chain chain, const Joints& from, const Joints& to) {
  SharedLaw law;
  for (std::size_t i = chain.first; i < chain.first + chain.count; ++i) {
    const double distance = std::abs(to[i] - from[i]);
    if (distance == 0) continue;
    law.time_factor =
        law.is_move ? std::max(law.time_factor, cell.axes[i].time_factor) : cell.axes[i].time_factor;
    law.speed_max = std::min(law.speed_max, cell.axes[i].speed_max / distance);
    law.acceleration_max = std::min(law.acceleration_max, cell.axes[i].acceleration_max / distance);
    law.is_move = true;
  }
  return law;
}

}  // namespace

double chain_move_s(const CellDescription& cell, Chain chain, Interpolation interpolation, const Joints& from,
                    const Joints& to) {
  if (interpolation == Interpolation::kCoordinated) {
    const SharedLaw law = shared_law(cell, chain, from, to);
    return law.is_move ? law.time_factor * trapezoid_s(1, law.speed_max, law.acceleration_max) : 0;
  }
  double slowest_s = 0;
  for (std::size_t i = chain.first; i < chain.first + chain.count; ++i)
    slowest_s = std::max(
        slowest_s, cell.axes[i].time_factor * trapezoid_s(std::abs(to[i] - from[i]), cell.axes[i].speed_max,
                                                          cell.axes[i].acceleration_max));
  return slowest_s;
}

void put_chain(const CellDescription& cell, Chain chain, Interpolation interpolation, const Joints& from,
               const Joints& to, double time_s, Joints& now) {
  const bool is_coordinated = interpolation == Interpolation::kCoordinated;
  const SharedLaw law = is_coordinated ? shared_law(cell, chain, from, to) : SharedLaw{};
  const double share =
      is_coordinated && law.is_move
          ? trapezoid_position(1, law.speed_max, law.acceleration_max, time_s / law.time_factor)
          : 1;
  for (std::size_t i = chain.first; i < chain.first + chain.count; ++i) {
    const double distance = std::abs(to[i] - from[i]);
    const double covered =
        is_coordinated ? share * distance
                       : trapezoid_position(distance, cell.axes[i].speed_max, cell.axes[i].acceleration_max,
                                            time_s / cell.axes[i].time_factor);
    // The end is exact, whatever the sum would round to.
    now[i] = covered >= distance ? to[i] : from[i] + std::copysign(covered, to[i] - from[i]);
  }
}

Joints joints_during(const CellDescription& cell, const Joints& from, const Joints& to, double time_s) {
  Joints now = to;
  put_chain(cell, kRobotChain, cell.motion.robot, from, to, time_s, now);
  put_chain(cell, kTableChain, cell.motion.table, from, to, time_s, now);
  return now;
}

double move_s(const CellDescription& cell, const Joints& from, const Joints& to) {
  const double slowest_s = std::max(chain_move_s(cell, kRobotChain, cell.motion.robot, from, to),
                                    chain_move_s(cell, kTableChain, cell.motion.table, from, to));
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
