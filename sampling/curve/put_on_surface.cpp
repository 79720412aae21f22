#include "sampling/curve/put_on_surface.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace hilbrush {
namespace {

using Eigen::Vector3d;

constexpr int kLongestWalk = 12;
/// A place that asks for less than this share of what its stratum asks for is blank.
constexpr double kBlankShare = 1e-3;

/// Barycentric coordinates of the point of a triangle that is nearest to `p` (Ericson, Real-Time Collision
/// Detection, 5.1.5).
Vector3d nearest_in(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& p) {
  const Vector3d ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap), d3 = ab.dot(bp), d4 = ac.dot(bp), d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
  const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {1 - d1 / (d1 - d3), d1 / (d1 - d3), 0};
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {1 - d2 / (d2 - d6), 0, d2 / (d2 - d6)};
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0, 1 - w, w};
  }
  const double sum = va + vb + vc;
  return {va / sum, vb / sum, vc / sum};
}

struct Nearest {
  SurfacePoint point;
  double distance2 = std::numeric_limits<double>::infinity();
};

Nearest nearest_on(const TexturedMesh& mesh, std::uint32_t t, const Vector3d& target) {
  Nearest nearest{{t, nearest_in(mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2), target)}, 0};
  nearest.distance2 = (position(mesh, nearest.point) - target).squaredNorm();
  return nearest;
}

Nearest walk_on(const TexturedMesh& mesh, const Neighbours& neighbours, Nearest here, const Vector3d& target) {
  for (int step = 0; step < kLongestWalk; ++step) {
    Nearest best = here;
    for (int side = 0; side < 3; ++side) {
      // Only across a side on which the nearest point lies: the one opposite a corner without weight.
      if (here.point.barycentric[(side + 2) % 3] > 0) continue;
      const TriangleSide across = neighbours[here.point.triangle][static_cast<std::size_t>(side)];
      if (across == kNoSide) continue;
      const Nearest there = nearest_on(mesh, across.triangle, target);
      if (there.distance2 < best.distance2 * (1 - 1e-12)) best = there;
    }
    if (best.point.triangle == here.point.triangle) break;
    here = best;
  }
  return here;
}

}  // namespace

SurfacePoint walk_towards(const TexturedMesh& mesh, const Neighbours& neighbours, const SurfacePoint& start,
                          const Vector3d& target_O) {
  return walk_on(mesh, neighbours, nearest_on(mesh, start.triangle, target_O), target_O).point;
}

SurfacePoint centre_on_surface(const SurfaceCurve::Implementation& curve, const ToneField& tone,
                               const Stratum& stratum) {
  const StratumPart& part = stratum.heaviest();
  const auto heaviest = std::max_element(part.crumbs.begin(), part.crumbs.end(),
                                         [](const Crumb& a, const Crumb& b) { return a.mass < b.mass; });
  // A stratum in the plane of one triangle needs no search.
  if (part.crumbs.size() == 1 && tone.asked(heaviest->centre) > 0) return heaviest->centre;

  const Vector3d target = part.moment_O / part.mass;
  Nearest nearest;
  std::uint32_t last = kNoTriangle;
  for (const Crumb& crumb : part.crumbs) {
    if (std::exchange(last, crumb.centre.triangle) == crumb.centre.triangle) continue;
    const Nearest candidate = nearest_on(curve.mesh, crumb.centre.triangle, target);
    if (candidate.distance2 < nearest.distance2) nearest = candidate;
  }
  nearest = walk_on(curve.mesh, curve.neighbours, nearest, target);
  const double asked = tone.asked(nearest.point);
  return asked > 0 && asked >= kBlankShare * tone.asked(heaviest->centre) ? nearest.point : heaviest->centre;
}

namespace {

/// A hair inside its triangle: a beam that is aimed at the very edge of an open surface may pass it by.
SurfacePoint inset(const TexturedMesh& mesh, const SurfacePoint& point) {
  constexpr double kInsetM = 2e-6, kMostShare = .1;
  const double twice_area = 2 * mesh.area_vector(point.triangle).norm();
  SurfacePoint inside = point;
  for (int c = 0; c < 3; ++c) {
    const double opposite =
        (mesh.corner(point.triangle, (c + 1) % 3) - mesh.corner(point.triangle, (c + 2) % 3)).norm();
    const double least = std::min(kMostShare, kInsetM * opposite / twice_area);
    inside.barycentric[c] = std::max(inside.barycentric[c], least);
  }
  inside.barycentric /= inside.barycentric.sum();
  return inside;
}

}  // namespace

Dot make_dot(const SurfaceCurve::Implementation& curve, const ToneField& tone, const SurfacePoint& place,
             std::uint32_t component) {
  const SurfacePoint point = inset(curve.mesh, place);
  Dot dot;
  dot.position_O = position(curve.mesh, point);
  dot.normal_O = face_normal(curve.mesh, point).cast<float>();
  const auto& normals = curve.corner_normals[point.triangle];
  Eigen::Vector3f smooth = Eigen::Vector3f::Zero();
  for (int c = 0; c < 3; ++c) smooth += static_cast<float>(point.barycentric[c]) * normals[static_cast<std::size_t>(c)];
  dot.smooth_normal_O = smooth.norm() > 1e-3f ? Eigen::Vector3f(smooth.normalized()) : dot.normal_O;
  dot.triangle = point.triangle;
  dot.component = component;
  dot.tone = static_cast<float>(tone.wanted(point));
  return dot;
}

}  // namespace hilbrush
