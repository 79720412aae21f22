#include "sampling/curve/stratum.h"

#include <algorithm>
#include <limits>

#include "sampling/curve/project_to_surface.h"
#include "sampling/curve/quad_walk.h"

namespace hilbrush {
namespace {

/// A point that asks for less than this share of what its stratum's heaviest point asks for counts as blank.
constexpr double kBlankShare = 1e-3;
/// Asked tone. A point that asks for this much cannot be blank: the tone that would make it so is 10, and
/// tones end at 1.
constexpr double kSurelyPainted = .01;

/// Of a base quad's faces with mass, the point nearest to `target_O`.
SurfacePoint nearest_in_quad(const CurveMass& mass, std::size_t quad_index, const Eigen::Vector3d& target_O) {
  const std::span<const PieceMass> pieces = mass.pieces_of(mass.quads()[quad_index]);
  const TexturedMesh& mesh = mass.mesh();
  // With few dots on a large mesh nothing of it is in the cache: all is requested before the first is needed.
  for (const PieceMass& piece : pieces) __builtin_prefetch(&mesh.triangles[piece.triangle]);
  for (const PieceMass& piece : pieces)
    for (const std::uint32_t vertex : mesh.triangles[piece.triangle])
      __builtin_prefetch(&mesh.vertices[vertex]);
  NearestPoint nearest{{}, std::numeric_limits<double>::infinity()};
  for (const PieceMass& piece : pieces) {
    if (!(piece.mass > 0)) continue;
    const NearestPoint there = nearest_in_triangle(mesh, piece.triangle, target_O);
    if (there.distance2 < nearest.distance2) nearest = there;
  }
  return nearest.point;
}

/// Of a run of base quads, the one whose center of mass is nearest to `target_O`.
std::size_t nearest_quad(const CurveMass& mass, const StratumPart& part, const Eigen::Vector3d& target_O) {
  std::size_t nearest = part.heaviest_quad;
  // Distances times mass are compared crosswise, without a division.
  double least = std::numeric_limits<double>::infinity(), mass_of_nearest = 1;
  for (std::size_t q = part.first_quad; q < part.last_quad; ++q) {
    const double quad_mass = mass.mass_of(q);
    if (!(quad_mass > 0)) continue;
    const double distance = (mass.quads()[q].moment_O - quad_mass * target_O).squaredNorm();
    if (distance * mass_of_nearest < least * quad_mass * quad_mass) {
      nearest = q;
      __builtin_prefetch(mass.pieces_of(mass.quads()[q]).data());  // what nearest_in_quad asks for
      least = distance;
      mass_of_nearest = quad_mass * quad_mass;
    }
  }
  return nearest;
}

SurfacePoint heaviest_point(const CurveMass& mass, const StratumPart& part) {
  if (part.heaviest_quad != StratumPart::kNoQuad) return heaviest_point(mass, part.heaviest_quad);
  if (part.polygon_size == 0 || mass.tone().asked(part.heaviest) > 0) return part.heaviest;
  return point_with_tone(mass.tone(), part.heaviest.triangle, {part.polygon.data(), part.polygon_size});
}

}  // namespace

SurfacePoint heaviest_point(const CurveMass& mass, std::size_t quad_index) {
  const QuadMass& quad = mass.quads()[quad_index];
  const BaseQuad& base = mass.base_quad(quad);
  const Chart& chart = mass.chart_of(quad);
  const std::span<const PieceMass> pieces = mass.pieces_of(quad);
  const auto heaviest = std::ranges::max_element(
      pieces, [](const PieceMass& a, const PieceMass& b) { return a.mass < b.mass; });
  const SurfacePoint center = point_in_triangle(heaviest->triangle, heaviest->center_b.cast<double>());
  if (mass.tone().asked(center) > 0) return center;
  std::vector<Eigen::Vector2d> polygon;
  with_curve(chart.kind, [&]<class Curve>(Curve) {
    constexpr int kDimensions = kDimensionsOf<Curve>;
    const ChartFace& face = chart.face_of(base, static_cast<std::uint32_t>(heaviest - pieces.begin()));
    auto piece = whole_piece<kDimensions>(chart, mass.mesh(), face);
    clip_to_box<kDimensions>(piece, base.low.template head<kDimensions>(), base.size);
    for (const auto& corner : piece.all()) polygon.push_back(corner.b);
  });
  return point_with_tone(mass.tone(), heaviest->triangle, polygon);
}

bool is_surely_painted(double asked) {
  return asked >= kSurelyPainted;
}

PaintedPoint center_on_surface(const CurveMass& mass, DotTriangles& triangles, const StratumPart& part) {
  SurfacePoint point;
  if (part.triangle != kNoTriangle) {
    // A stratum in the plane of one triangle needs no search.
    point = point_in_triangle(part.triangle, part.moment_b / part.mass);
  } else {
    const Eigen::Vector3d target = part.moment_O / part.mass;
    const SurfacePoint start = part.heaviest_quad == StratumPart::kNoQuad
                                   ? part.heaviest
                                   : nearest_in_quad(mass, nearest_quad(mass, part, target), target);
    point = walk_towards(mass.curve().surface(), start, target);
  }
  const auto painted = [&](const SurfacePoint& place) {
    return PaintedPoint{place, triangles[place.triangle].asked(place.barycentric)};
  };
  const PaintedPoint center = painted(point);
  if (is_surely_painted(center.asked)) return center;
  const PaintedPoint heaviest = painted(heaviest_point(mass, part));
  return center.asked > 0 && center.asked >= kBlankShare * heaviest.asked ? center : heaviest;
}

}  // namespace hilbrush
