#pragma once
#include <span>

#include "sampling/curve/surface.h"
#include "sampling/tone/tone_field.h"

/// From positions in space to points on the surface.
namespace hilbrush {

/// The surface point nearest to `target_O` near `start`: a short walk from triangle to triangle.
SurfacePoint walk_towards(const Surface& surface, const SurfacePoint& start, const Eigen::Vector3d& target_O);

/// The point of a triangle that is nearest to `target_O`, and how far that is, squared.
struct NearestPoint {
  SurfacePoint point;
  double distance2 = 0;
};
NearestPoint nearest_in_triangle(const TexturedMesh& mesh, std::uint32_t triangle,
                                 const Eigen::Vector3d& target_O);

/// A point that asks for dots, in a polygon within a triangle: the polygon is halved towards its mass until
/// its center asks for dots. Corners by second and third barycentric coordinate. The polygon's first corner
/// if it has no mass.
SurfacePoint point_with_tone(const ToneField& tone, std::uint32_t triangle,
                             std::span<const Eigen::Vector2d> polygon);

}  // namespace hilbrush
