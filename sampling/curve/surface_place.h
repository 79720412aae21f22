#pragma once
#include "sampling/curve/project_to_surface.h"
#include "sampling/curve/surface.h"
#include "sampling/tone/tone_field.h"

/// Where a dot is while it moves: always on the surface.
namespace hilbrush {

struct SurfacePlace {
  Eigen::Vector3d position_O = Eigen::Vector3d::Zero();
  std::uint32_t triangle = 0;
  std::uint32_t component = 0;
};

/// The surface point of a triangle at a position in its plane. foot_of_perpendicular() finds the same, but
/// rounds differently: dots depend on the last bits of both, so both stay.
inline SurfacePoint surface_point_at(const TexturedMesh& mesh, std::uint32_t triangle,
                                     const Eigen::Vector3d& position_O) {
  const Eigen::Vector3d &a = mesh.corner(triangle, 0), &b = mesh.corner(triangle, 1),
                        &c = mesh.corner(triangle, 2);
  const Eigen::Vector3d twice_area = (b - a).cross(c - a), from_a = position_O - a;
  const double scale = 1 / twice_area.squaredNorm();
  const double v = from_a.cross(c - a).dot(twice_area) * scale,
               w = (b - a).cross(from_a).dot(twice_area) * scale;
  return {triangle, {1 - v - w, v, w}};
}

/// Moves `place` to the surface nearest to `target_O`, unless that is blank: then it stays. Returns whether
/// it moved.
inline bool move_to(SurfacePlace& place, const Surface& surface, const ToneField& tone,
                    const Eigen::Vector3d& target_O) {
  const SurfacePoint point = walk_towards(surface, {place.triangle, {}}, target_O);
  if (!(tone.asked(point) > 0)) return false;
  place.position_O = position(surface.mesh, point);
  place.triangle = point.triangle;
  return true;
}

}  // namespace hilbrush
