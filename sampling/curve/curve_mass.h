#pragma once
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "sampling/curve/chart.h"
#include "sampling/curve/surface_curve.h"
#include "sampling/tone/tone_field.h"

/// What a tone weighs along a curve.
namespace hilbrush {

/// What a base quad cuts out of one triangle. The mass is exact; the other members only locate it and decide
/// whether it is even.
struct PieceMass {
  double mass = 0;             ///< m^2 of asked coverage
  float square = 0;            ///< as ToneIntegral
  std::uint32_t triangle = 0;  ///< as in the face list, which may be far away in memory
  Eigen::Vector2f center_b = Eigen::Vector2f::Zero();  ///< center of mass

  /// Over a piece of this area.
  ToneIntegral integral(double area_m2) const {
    return {area_m2, mass, mass * center_b.cast<double>(), square};
  }
};

struct QuadMass {
  std::uint32_t chart = 0;
  std::uint32_t quad = 0;         ///< in Chart::base_quads
  std::uint32_t first_piece = 0;  ///< one piece for each of the base quad's faces: CurveMass::pieces_of()
  std::uint32_t piece_count = 0;
  /// Bound on the mass that lies elsewhere than if the quad's were spread evenly over its square.
  float misplaced = std::numeric_limits<float>::infinity();
  std::uint32_t depth = 0;
  Eigen::Vector3d moment_O = Eigen::Vector3d::Zero();  ///< mass times position
};

/// Exact integrals of the asked tone over every piece of every quad of the base tree. Another count or
/// sampler on the same tone uses them again.
class CurveMass {
 public:
  /// Keeps references to both, which must outlive it and stay where they are. Cost: one integral for each
  /// triangle in each quad, in parallel; 24 bytes for each.
  CurveMass(const SurfaceCurve& curve, const ToneField& tone);

  double total_m2() const { return mass_before_.back(); }  ///< asked coverage times area

  const SurfaceCurve& curve() const { return curve_; }
  const TexturedMesh& mesh() const { return curve_.mesh(); }
  const ToneField& tone() const { return tone_; }
  /// Of a chart: of the pieces that ask for dots.
  double painted_area_m2(std::size_t chart) const { return painted_area_m2_[chart]; }

  /// All base quads, in order of the curve.
  const std::vector<QuadMass>& quads() const { return quads_; }
  /// Where on the curve's mass a quad begins; of the number of quads, where the curve ends.
  double mass_before(std::size_t quad) const { return mass_before_[quad]; }
  double mass_of(std::size_t quad) const { return mass_before_[quad + 1] - mass_before_[quad]; }
  /// The quad in whose stretch of mass `at` lies.
  std::size_t quad_at(double at) const;

  const Chart& chart_of(const QuadMass& quad) const { return curve_.charts()[quad.chart]; }
  const BaseQuad& base_quad(const QuadMass& quad) const { return chart_of(quad).base_quads[quad.quad]; }
  std::span<const PieceMass> pieces_of(const QuadMass& quad) const {
    return {pieces_.data() + quad.first_piece, quad.piece_count};
  }

 private:
  void list_quads();
  template <class Curve>
  void measure(QuadMass& result, double& painted_area_m2);

  const SurfaceCurve& curve_;
  const ToneField& tone_;
  std::vector<QuadMass> quads_;
  std::vector<double> mass_before_;  ///< one more than there are quads
  std::vector<PieceMass> pieces_;    ///< of all quads
  std::vector<double> painted_area_m2_;
};

}  // namespace hilbrush
