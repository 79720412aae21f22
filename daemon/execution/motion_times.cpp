#include "daemon/execution/motion_times.h"

#include <algorithm>
#include <cmath>

#include "planner/cell_model/time_model.h"

namespace hilbrush {
namespace {

constexpr std::uint64_t kMovesLeast = 100;
constexpr std::uint64_t kMovesOfAxisLeast = 20;
/// Moves that all take nearly the same time don't tell a delay from a factor: then it counts as a factor.
constexpr double kVarietyLeast = .01;

}  // namespace

bool MeasuredMotion::is_enough() const {
  for (std::size_t i = 0; i < kAxisCount; ++i)
    if (time_factor[i] && moves[i] < kMovesEnough) return false;
  return true;
}

void MotionTimes::add(const CellDescription& cell, const Joints& from, const Joints& to, double seconds) {
  std::size_t slowest = 0;
  double slowest_s = -1;
  double promised_s = 0;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const AxisDescription& axis = cell.axes[i];
    const double alone_s = trapezoid_s(std::abs(to[i] - from[i]), axis.speed_max, axis.acceleration_max);
    if (alone_s * axis.time_factor <= slowest_s) continue;
    slowest = i;
    slowest_s = alone_s * axis.time_factor;
    promised_s = alone_s;
  }
  if (promised_s <= 0) return;
  // Axes are seen to arrive with the control tick; which is not their fault.
  if (cell.timing.tick_s > 0)
    promised_s = std::ceil(promised_s / cell.timing.tick_s - 1e-9) * cell.timing.tick_s;
  Sums& sums = axes_[slowest];
  ++sums.moves;
  sums.promised += promised_s;
  sums.measured += seconds;
  sums.promised2 += promised_s * promised_s;
  sums.product += promised_s * seconds;
}

void MotionTimes::add(const MotionTimes& other) {
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    axes_[i].moves += other.axes_[i].moves;
    axes_[i].promised += other.axes_[i].promised;
    axes_[i].measured += other.axes_[i].measured;
    axes_[i].promised2 += other.axes_[i].promised2;
    axes_[i].product += other.axes_[i].product;
  }
}

std::uint64_t MotionTimes::count() const {
  std::uint64_t moves = 0;
  for (const Sums& sums : axes_) moves += sums.moves;
  return moves;
}

/// For a given delay each axis has its best factor; put in, one equation for the delay is left.
double MotionTimes::delay_s() const {
  double unexplained_s = 0;
  double variety = 0;
  for (const Sums& sums : axes_) {
    if (sums.moves == 0) continue;
    unexplained_s += sums.measured - sums.promised * sums.product / sums.promised2;
    variety += static_cast<double>(sums.moves) - sums.promised * sums.promised / sums.promised2;
  }
  if (variety < kVarietyLeast * static_cast<double>(count())) return 0;
  return std::max(0., unexplained_s / variety);
}

std::optional<MeasuredMotion> MotionTimes::measured() const {
  if (count() < kMovesLeast) return std::nullopt;
  MeasuredMotion motion;
  motion.move_delay_s = delay_s();
  for (std::size_t i = 0; i < kAxisCount; ++i) motion.moves[i] = axes_[i].moves;
  for (std::size_t i = 0; i < kAxisCount; ++i)
    if (axes_[i].moves >= kMovesOfAxisLeast)
      motion.time_factor[i] =
          (axes_[i].product - motion.move_delay_s * axes_[i].promised) / axes_[i].promised2;
  return motion;
}

}  // namespace hilbrush
