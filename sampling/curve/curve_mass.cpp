#include "sampling/curve/curve_mass.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "sampling/base/check.h"
#include "sampling/base/cross.h"
#include "sampling/curve/quad_walk.h"

namespace hilbrush {
namespace {

/// Quads that one thread takes at once.
constexpr std::size_t kGrain = 256;

/// m^2 for a unit of the square; infinite where the map has no area.
double density_on_square(const Chart& chart, const TriangleTone& tone, const ChartFace& face) {
  const auto b = chart.corners_b(face);
  const auto& p = face.places;
  return tone.space() * std::abs(cross(b[1] - b[0], b[2] - b[0]) / cross(p[1] - p[0], p[2] - p[0]));
}

}  // namespace

template <class Curve>
void CurveMass::measure(QuadMass& result, double& painted_area_m2) {
  constexpr int kDimensions = kDimensionsOf<Curve>;
  const Chart& chart = chart_of(result);
  const BaseQuad& quad = base_quad(result);
  PieceMass* pieces = pieces_.data() + result.first_piece;
  double total = 0;
  double squares = 0;
  for (std::uint32_t i = 0; i < quad.face_count; ++i) {
    const ChartFace& face = chart.face_of(quad, i);
    pieces[i].triangle = face.triangle;
    const TriangleTone tone = tone_.on(face.triangle);
    if (tone.is_blank()) continue;
    auto piece = whole_piece<kDimensions>(chart, mesh(), face);
    clip_to_box<kDimensions>(piece, quad.low.template head<kDimensions>(), quad.size);
    const ToneIntegral integral = integrate(tone, piece);
    if (!(integral.mass > 0)) continue;
    const Eigen::Vector2d center = integral.first / integral.mass;
    pieces[i] = {integral.mass, static_cast<float>(integral.square), face.triangle, center.cast<float>()};
    total += integral.mass;
    painted_area_m2 += integral.area_m2;
    result.moment_O +=
        integral.mass * position(mesh(), {face.triangle, {1 - center.sum(), center.x(), center.y()}});
    if constexpr (kDimensions == 2) squares += integral.square * density_on_square(chart, tone, face);
  }
  if constexpr (kDimensions == 2)
    if (std::isfinite(squares))
      result.misplaced =
          static_cast<float>(std::sqrt(std::max(0., squares * quad.size * quad.size - total * total)));
}

void CurveMass::list_quads() {
  const std::vector<Chart>& charts = curve_.charts();
  std::size_t piece_count = 0;
  for (std::uint32_t c = 0; c < charts.size(); ++c)
    for (std::uint32_t q = 0; q < charts[c].base_quads.size(); ++q) {
      const BaseQuad& base = charts[c].base_quads[q];
      QuadMass& quad = quads_.emplace_back();
      quad.chart = c;
      quad.quad = q;
      quad.first_piece = static_cast<std::uint32_t>(piece_count);
      quad.piece_count = base.face_count;
      quad.depth = base.depth;
      piece_count += base.face_count;
    }
  CHECK_LE(piece_count, std::numeric_limits<std::uint32_t>::max());
  pieces_.resize(piece_count);
}

CurveMass::CurveMass(const SurfaceCurve& curve, const ToneField& tone) : curve_(curve), tone_(tone) {
  CHECK(&curve.mesh() == &tone.mesh());
  list_quads();
  std::vector<double> painted_area_m2(quads_.size(), 0);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, quads_.size(), kGrain), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i)
      with_curve(chart_of(quads_[i]).kind,
                 [&]<class Curve>(Curve) { measure<Curve>(quads_[i], painted_area_m2[i]); });
  });
  painted_area_m2_.assign(curve_.charts().size(), 0);
  mass_before_.assign(quads_.size() + 1, 0);
  for (std::size_t i = 0; i < quads_.size(); ++i) {
    double sum = 0;
    for (const PieceMass& piece : pieces_of(quads_[i])) sum += piece.mass;
    painted_area_m2_[quads_[i].chart] += painted_area_m2[i];
    mass_before_[i + 1] = mass_before_[i] + sum;
  }
}

std::size_t CurveMass::quad_at(double at) const {
  const auto above = std::upper_bound(mass_before_.begin() + 1, mass_before_.end() - 1, at);
  return static_cast<std::size_t>(above - mass_before_.begin()) - 1;
}

}  // namespace hilbrush
