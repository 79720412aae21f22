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

template <class Curve>
void measure(const CurveMass::Implementation& mass, QuadMass& result, PieceMass* pieces, double& painted_area_m2) {
  constexpr int kDimensions = kDimensionsOf<Curve>;
  const Chart& chart = mass.chart_of(result);
  const BaseQuad& quad = mass.base_quad(result);
  double total = 0, squares = 0;
  for (std::uint32_t i = 0; i < quad.face_count; ++i) {
    const ChartFace& face = chart.face_of(quad, i);
    pieces[i].triangle = face.triangle;
    const TriangleTone tone = mass.tone.on(face.triangle);
    if (tone.is_blank()) continue;
    auto piece = whole_piece<kDimensions>(chart, mass.curve.mesh, face);
    clip_to_box<kDimensions>(piece, quad.low.template head<kDimensions>(), quad.size);
    const ToneIntegral integral = integrate(tone, piece);
    if (!(integral.mass > 0)) continue;
    const Eigen::Vector2d center = integral.first / integral.mass;
    pieces[i] = {integral.mass, static_cast<float>(integral.square), face.triangle, center.cast<float>()};
    total += integral.mass;
    painted_area_m2 += integral.area_m2;
    result.moment_O +=
        integral.mass * position(mass.curve.mesh, {face.triangle, {1 - center.sum(), center.x(), center.y()}});
    if constexpr (kDimensions == 2) squares += integral.square * density_on_square(chart, tone, face);
  }
  if constexpr (kDimensions == 2)
    if (std::isfinite(squares))
      result.misplaced = static_cast<float>(std::sqrt(std::max(0., squares * quad.size * quad.size - total * total)));
}

}  // namespace

std::size_t CurveMass::Implementation::quad_at(double at) const {
  const auto above = std::upper_bound(mass_before.begin() + 1, mass_before.end() - 1, at);
  return static_cast<std::size_t>(above - mass_before.begin()) - 1;
}

CurveMass::CurveMass(const SurfaceCurve& curve, const ToneField& tone)
    : implementation_(std::make_unique<Implementation>(curve.implementation(), tone)) {
  CHECK(&curve.mesh() == &tone.mesh());
  Implementation& mass = *implementation_;
  std::size_t piece_count = 0;
  for (std::uint32_t s = 0; s < mass.curve.charts.size(); ++s)
    for (std::uint32_t q = 0; q < mass.curve.charts[s].base_quads.size(); ++q) {
      const BaseQuad& base = mass.curve.charts[s].base_quads[q];
      QuadMass& quad = mass.quads.emplace_back();
      quad.chart = s;
      quad.quad = q;
      quad.first_piece = static_cast<std::uint32_t>(piece_count);
      quad.piece_count = base.face_count;
      quad.depth = base.depth;
      piece_count += base.face_count;
    }
  CHECK_LE(piece_count, std::numeric_limits<std::uint32_t>::max());
  mass.pieces.resize(piece_count);
  std::vector<double> painted_area_m2(mass.quads.size(), 0);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, mass.quads.size(), kGrain), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      QuadMass& quad = mass.quads[i];
      PieceMass* pieces = mass.pieces.data() + quad.first_piece;
      with_curve(mass.chart_of(quad).kind,
                 [&]<class Curve>(Curve) { measure<Curve>(mass, quad, pieces, painted_area_m2[i]); });
    }
  });
  mass.painted_area_m2.assign(mass.curve.charts.size(), 0);
  mass.mass_before.assign(mass.quads.size() + 1, 0);
  for (std::size_t i = 0; i < mass.quads.size(); ++i) {
    const QuadMass& quad = mass.quads[i];
    double sum = 0;
    for (const PieceMass& piece : mass.pieces_of(quad)) sum += piece.mass;
    mass.painted_area_m2[quad.chart] += painted_area_m2[i];
    mass.mass_before[i + 1] = mass.mass_before[i] + sum;
  }
}

CurveMass::~CurveMass() = default;
CurveMass::CurveMass(CurveMass&&) noexcept = default;

double CurveMass::total_m2() const {
  return implementation_->total();
}

}  // namespace hilbrush
