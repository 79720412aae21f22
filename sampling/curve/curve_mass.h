#pragma once
#include <cstdint>
#include <limits>
#include <vector>

#include "sampling/curve/surface_curve.h"

/// What CurveMass keeps.
namespace hilbrush {

/// The integrals over what a base quad cuts out of one triangle. The mass is exact; the rest only places and decides.
struct PieceMass {
  double mass = 0;                                     ///< m^2 of asked coverage
  Eigen::Vector2f centre_b = Eigen::Vector2f::Zero();  ///< centre of mass
  float area_m2 = 0, square = 0;                       ///< as ToneIntegral

  ToneIntegral integral() const { return {area_m2, mass, mass * centre_b.cast<double>(), square}; }
};

struct QuadMass {
  std::uint32_t sheet = 0, quad = 0;
  /// Bound on the mass that lies elsewhere than if the quad's were spread evenly over its square.
  float misplaced = std::numeric_limits<float>::infinity();
  std::uint32_t depth = 0;
  double painted_area_m2 = 0;                          ///< of the pieces that ask for dots
  Eigen::Vector3d moment_O = Eigen::Vector3d::Zero();  ///< mass times place
};

struct CurveMass::Implementation {
  Implementation(const SurfaceCurve::Implementation& c, const ToneField& t) : curve(c), tone(t) {}

  const SurfaceCurve::Implementation& curve;
  const ToneField& tone;
  std::vector<QuadMass> quads;           ///< all base quads, in order of the curve
  std::vector<double> mass_before;       ///< mass_before[i] .. mass_before[i + 1] is quad i's stretch
  std::vector<PieceMass> pieces;         ///< of all face lists, one sheet after another
  std::vector<std::size_t> first_piece;  ///< of each sheet
  std::vector<double> painted_area_m2;   ///< of each sheet

  double total() const { return mass_before.back(); }
  const Sheet& sheet_of(const QuadMass& quad) const { return curve.sheets[quad.sheet]; }
  const BaseQuad& base_quad(const QuadMass& quad) const { return sheet_of(quad).base_quads[quad.quad]; }
  const PieceMass* pieces_of(const QuadMass& quad) const {
    return pieces.data() + first_piece[quad.sheet] + base_quad(quad).first_face;
  }
  double mass_of(std::size_t quad) const { return mass_before[quad + 1] - mass_before[quad]; }
  /// The quad in whose stretch `at` lies.
  std::size_t quad_at(double at) const;
};

}  // namespace hilbrush
