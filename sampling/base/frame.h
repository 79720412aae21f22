#pragma once
#include <Eigen/Core>
#include <cmath>

namespace hilbrush {

/// A right-handed orthonormal frame whose third column is the unit vector z (Duff et al., "Building an
/// Orthonormal Basis, Revisited", 2017).
inline Eigen::Matrix3d frame_about(const Eigen::Vector3d& z) {
  const double sign = std::copysign(1., z.z());
  const double a = -1 / (sign + z.z());
  const double b = z.x() * z.y() * a;
  Eigen::Matrix3d frame;
  frame.col(0) << 1 + sign * z.x() * z.x() * a, sign * b, -sign * z.x();
  frame.col(1) << b, sign + z.y() * z.y() * a, -z.y();
  frame.col(2) = z;
  return frame;
}

}  // namespace hilbrush
