#pragma once
#include <Eigen/Core>

namespace hilbrush {

/// Twice the signed area of the triangle that two vectors of the plane span; positive if `b` is to the left
/// of `a`.
inline double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

}  // namespace hilbrush
