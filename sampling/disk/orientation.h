#pragma once
#include <Eigen/Core>

namespace hilbrush {

/// Exact sign of the area of triangle abc: 1 counter-clockwise, -1 clockwise, 0 on one line. Never wrong by
/// rounding (barring overflow and underflow): a fast test with an error bound, then exact sums. After
/// Shewchuk, "Adaptive Precision Floating-Point Arithmetic", 1997.
int orientation(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c);

}  // namespace hilbrush
