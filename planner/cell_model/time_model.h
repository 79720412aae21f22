#pragma once
#include "planner/cell_model/cell_description.h"

/// How long the cell takes and where its axes are meanwhile: trapezoidal speeds, slowest axis, settle that
/// grows with the move. Standard library and Eigen only, so that the daemon's ETA and the simulated devices'
/// tests can compare against it.
namespace hilbrush {

/// Rest to rest over `distance` (>= 0) with a trapezoidal speed profile.
double trapezoid_s(double distance, double speed_max, double acceleration_max);
/// Where an axis is `time_s` into such a move: 0 before it, `distance` after it.
double trapezoid_position(double distance, double speed_max, double acceleration_max, double time_s);
/// One chain from rest to rest, with the measured time factors; not rounded.
double chain_move_s(const CellDescription& cell, Chain chain, Interpolation interpolation, const Joints& from,
                    const Joints& to);
/// Puts the joints of a chain where they are `time_s` into the move; the other joints of `now` are left
/// alone.
void put_chain(const CellDescription& cell, Chain chain, Interpolation interpolation, const Joints& from,
               const Joints& to, double time_s, Joints& now);
/// Where all joints are `time_s` into a move of both chains at once, by the cell's interpolation.
Joints joints_during(const CellDescription& cell, const Joints& from, const Joints& to, double time_s);
/// The slowest chain, rounded up to whole control ticks.
double move_s(const CellDescription& cell, const Joints& from, const Joints& to);
double settle_s(const CellDescription& cell, const Joints& from, const Joints& to);
/// Move and settle of a direct move between two exposures.
double step_s(const CellDescription& cell, const Joints& from, const Joints& to);

}  // namespace hilbrush
