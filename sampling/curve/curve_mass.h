#pragma once
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "sampling/curve/surface_curve.h"

/// What CurveMass keeps.
namespace hilbrush {

/// What a base quad cuts out of one triangle. The mass is exact; the rest only places and decides.
struct PieceMass {
  double mass = 0;             ///< m^2 of asked coverage
  float square = 0;            ///< as ToneIntegral
  std::uint32_t triangle = 0;  ///< here as well as in the face list: places are looked for among quads far apart
  Eigen::Vector2f center_b = Eigen::Vector2f::Zero();  ///< center of mass

  /// Over a piece of this area.
  ToneIntegral integral(double area_m2) const { return {area_m2, mass, mass * center_b.cast<double>(), square}; }
};

struct QuadMass {
  std::uint32_t chart = 0, quad = 0;
  std::uint32_t first_piece = 0, piece_count = 0;  ///< in `pieces`, one for each of the base quad's faces
  /// Bound on the mass that lies elsewhere than if the quad's were spread evenly over its square.
  float misplaced = std::numeric_limits<float>::infinity();
  std::uint32_t depth = 0;
  Eigen::Vector3d moment_O = Eigen::Vector3d::Zero();  ///< mass times place
};

struct CurveMass::Implementation {
  Implementation(const SurfaceCurve::Implementation& c, const ToneField& t) : curve(c), tone(t) {}

  const SurfaceCurve::Implementation& curve;
  const ToneField& tone;
  std::vector<QuadMass> quads;          ///< all base quads, in order of the curve
  std::vector<double> mass_before;      ///< mass_before[i] .. mass_before[i + 1] is quad i's stretch
  std::vector<PieceMass> pieces;        ///< of all quads
  std::vector<double> painted_area_m2;  ///< of each chart: of the pieces that ask for dots

  double total() const { return mass_before.back(); }
  const Chart& chart_of(const QuadMass& quad) const { return curve.charts[quad.chart]; }
  const BaseQuad& base_quad(const QuadMass& quad) const { return chart_of(quad).base_quads[quad.quad]; }
  std::span<const PieceMass> pieces_of(const QuadMass& quad) const {
    return {pieces.data() + quad.first_piece, quad.piece_count};
  }
  double mass_of(std::size_t quad) const { return mass_before[quad + 1] - mass_before[quad]; }
  /// The quad in whose stretch `at` lies.
  std::size_t quad_at(double at) const;
};

}  // namespace hilbrush
