#pragma once
#include <Eigen/Core>

namespace hilbrush {

/// Barycentric coordinates of the point of triangle a, b, c that is nearest to `p` (Ericson, Real-Time
/// Collision Detection, 5.1.5); those of a corner if the triangle has no area.
Eigen::Vector3d nearest_in_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                    const Eigen::Vector3d& b, const Eigen::Vector3d& c);

}  // namespace hilbrush
