#include "sampling/gaps/square_places.h"

#include <algorithm>
#include <cmath>

#include "sampling/curve/chart.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Barycentric coordinates of b in a face; all 0 if it has no area in its triangle.
Vector3d weights_in(const std::array<Vector2d, 3>& corners_b, const Vector2d& b) {
  const Vector2d& o = corners_b[0];
  const Vector2d p = corners_b[1] - o;
  const Vector2d q = corners_b[2] - o;
  const Vector2d w = b - o;
  const double area = p.x() * q.y() - p.y() * q.x();
  if (area == 0) return Vector3d::Zero();
  const double f = (w.x() * q.y() - w.y() * q.x()) / area;
  const double g = (p.x() * w.y() - p.y() * w.x()) / area;
  return {1 - f - g, f, g};
}

}  // namespace

SquarePlaces::SquarePlaces(const SurfaceCurve& curve) : curve_(curve) {
  components_.assign(curve.mesh().triangle_count(), 0);
  first_.assign(curve.mesh().triangle_count() + 1, 0);
  for (const Chart& chart : curve.charts())
    for (const ChartFace& face : chart.faces) {
      components_[face.triangle] = chart.component;
      ++first_[face.triangle + 1];
    }
  for (std::size_t t = 1; t < first_.size(); ++t) first_[t] += first_[t - 1];
  faces_.resize(first_.back());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  for (std::uint32_t s = 0; s < curve.charts().size(); ++s)
    for (std::uint32_t f = 0; f < curve.charts()[s].faces.size(); ++f)
      faces_[next[curve.charts()[s].faces[f].triangle]++] = {s, f};
}

std::optional<SquarePlaces::Place> SquarePlaces::place(const SurfacePoint& point) const {
  const Vector2d b = point.barycentric.tail<2>();
  std::optional<Place> best;
  double deepest = -1e300;
  for (std::uint32_t i = first_[point.triangle]; i < first_[point.triangle + 1]; ++i) {
    const Chart& chart = curve_.charts()[faces_[i].chart];
    if (chart.kind == ChartKind::kHilbertCube) continue;
    const ChartFace& face = chart.faces[faces_[i].face];
    const Vector3d weights = weights_in(chart.corners_b(face), b);
    if (weights.minCoeff() <= deepest) continue;
    deepest = weights.minCoeff();
    best = {faces_[i].chart,
            weights[0] * face.places[0] + weights[1] * face.places[1] + weights[2] * face.places[2]};
  }
  return best;
}

}  // namespace hilbrush
