#pragma once
#include "sampling/curve/project_to_surface.h"
#include "sampling/curve/stream_dots.h"

/// A dot's place while it moves: on the surface, always.
namespace hilbrush {

struct SurfacePlace {
  Eigen::Vector3d position_O = Eigen::Vector3d::Zero();
  std::uint32_t triangle = 0, component = 0;
};

/// The surface point of a triangle at a position in its plane.
inline SurfacePoint surface_point_at(const TexturedMesh& mesh, std::uint32_t triangle,
                                     const Eigen::Vector3d& position_O) {
  const Eigen::Vector3d &a = mesh.corner(triangle, 0), &b = mesh.corner(triangle, 1), &c = mesh.corner(triangle, 2);
  const Eigen::Vector3d twice_area = (b - a).cross(c - a), from_a = position_O - a;
  const double scale = 1 / twice_area.squaredNorm();
  const double v = from_a.cross(c - a).dot(twice_area) * scale, w = (b - a).cross(from_a).dot(twice_area) * scale;
  return {triangle, {1 - v - w, v, w}};
}

/// Moves `place` to the surface nearest to `target_O`, unless that is blank: then it stays. Returns whether it moved.
inline bool move_to(SurfacePlace& place, const SurfaceCurve& curve, const ToneField& tone,
                    const Eigen::Vector3d& target_O) {
  const SurfacePoint start{place.triangle, {}};
  const SurfacePoint point = walk_towards(curve.mesh(), curve.implementation().neighbors, start, target_O);
  if (!(tone.asked(point) > 0)) return false;
  place.position_O = position(curve.mesh(), point);
  place.triangle = point.triangle;
  return true;
}

/// Two directions that make a right-handed frame with the unit vector z (Duff et al., "Building an Orthonormal Basis,
/// Revisited", 2017).
inline Eigen::Matrix3d frame_about(const Eigen::Vector3d& z) {
  const double sign = std::copysign(1., z.z()), a = -1 / (sign + z.z()), b = z.x() * z.y() * a;
  Eigen::Matrix3d frame;
  frame.col(0) << 1 + sign * z.x() * z.x() * a, sign * b, -sign * z.x();
  frame.col(1) << b, sign + z.y() * z.y() * a, -z.y();
  frame.col(2) = z;
  return frame;
}

}  // namespace hilbrush
