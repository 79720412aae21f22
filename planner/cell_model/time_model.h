#pragma once
#include "planner/cell_model/cell_description.h"

/// How long the cell takes: trapezoidal per axis, slowest axis, settle that grows with the move. Standard library and
/// Eigen only, so that the daemon's ETA and the simulated devices' tests can compare against it.
namespace hilbrush {

/// Rest to rest over `distance` (>= 0) with a trapezoidal speed profile.
double trapezoid_s(double distance, double speed_max, double acceleration_max);
/// The slowest axis, with its measured time factor, rounded up to whole control ticks.
double move_s(const CellDescription& cell, const Joints& from, const Joints& to);
double settle_s(const CellDescription& cell, const Joints& from, const Joints& to);
/// Move and settle of a direct move between two exposures.
double step_s(const CellDescription& cell, const Joints& from, const Joints& to);

}  // namespace hilbrush
