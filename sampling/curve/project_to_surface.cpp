#include "sampling/curve/project_to_surface.h"

#include <algorithm>
#include <vector>

#include "sampling/curve/quad_walk.h"
#include "sampling/model/nearest_in_triangle.h"

namespace hilbrush {
namespace {

using Eigen::Vector3d;

/// Triangles. Across needles one pitch may span many.
constexpr int kMaxWalk = 64;
constexpr int kMaxHalvings = 40;

}  // namespace

NearestPoint nearest_in_triangle(const TexturedMesh& mesh, std::uint32_t t, const Vector3d& target) {
  NearestPoint nearest{
      {t, nearest_in_triangle(target, mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2))}, 0};
  nearest.distance2 = (position(mesh, nearest.point) - target).squaredNorm();
  return nearest;
}

SurfacePoint walk_towards(const Surface& surface, const SurfacePoint& start, const Vector3d& target) {
  NearestPoint here = nearest_in_triangle(surface.mesh, start.triangle, target);
  for (int step = 0; step < kMaxWalk; ++step) {
    NearestPoint best = here;
    for (int side = 0; side < 3; ++side) {
      // Only across a side on which the nearest point lies: opposite a corner whose coordinate is 0.
      if (here.point.barycentric[(side + 2) % 3] > 0) continue;
      const TriangleSide across = surface.neighbors[here.point.triangle][static_cast<std::size_t>(side)];
      if (across == kNoSide) continue;
      const NearestPoint there = nearest_in_triangle(surface.mesh, across.triangle, target);
      if (there.distance2 < best.distance2 * (1 - 1e-12)) best = there;
    }
    if (best.point.triangle == here.point.triangle) break;
    here = best;
  }
  return here.point;
}

SurfacePoint point_with_tone(const ToneField& field, std::uint32_t triangle,
                             std::span<const Eigen::Vector2d> polygon) {
  const TriangleTone tone = field.on(triangle);
  Piece<2> piece;
  for (const Eigen::Vector2d& b : polygon) piece.add({b, b});
  const auto center_of = [&](const ToneIntegral& integral) {
    return Eigen::Vector2d(integral.mass > 0 ? integral.first / integral.mass : polygon[0]);
  };
  Eigen::Vector2d center = center_of(integrate(tone, piece));
  for (int halving = 0; halving < kMaxHalvings && !(tone.asked(center) > 0); ++halving) {
    Piece<2> lower, upper;
    cut_piece(piece, halving % 2, center[halving % 2], lower, upper);
    const ToneIntegral of_lower = integrate(tone, lower), of_upper = integrate(tone, upper);
    const bool is_lower = of_lower.mass > of_upper.mass;
    const ToneIntegral& heavier = is_lower ? of_lower : of_upper;
    if (!(heavier.mass > 0)) break;
    piece = is_lower ? lower : upper;
    center = center_of(heavier);
  }
  return {triangle, {1 - center.sum(), center.x(), center.y()}};
}

}  // namespace hilbrush
