#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>

#include "sampling/tone/tone_layer.h"

namespace hilbrush {

class ToneField;

/// Integrals of the asked coverage over a piece of a triangle, over its area in space.
struct ToneIntegral {
  double area_m2 = 0;
  double mass = 0;                                  ///< m^2: asked coverage times area
  Eigen::Vector2d first = Eigen::Vector2d::Zero();  ///< asked coverage times (barycentric 1, barycentric 2)
  double square = 0;  ///< asked coverage squared, for the deviation of equations 7.3 and 7.4
};

/// The asked tone on one triangle, made ready for many look-ups and integrals: where it comes from, and the
/// triangle in texels. Refers to the ToneField that made it.
class TriangleTone {
 public:
  TriangleTone() = default;

  /// At second and third barycentric coordinate.
  double asked(const Eigen::Vector2d& b) const;
  /// The wanted tone there.
  double wanted(const Eigen::Vector2d& b) const;
  /// What is asked for is what is wanted, everywhere.
  bool is_wanted_asked() const { return is_wanted_asked_; }

  /// Exact (but for rounding) over a convex polygon; its corners by second and third barycentric coordinate,
  /// in either sense of rotation. Thread-safe.
  ToneIntegral integrate(std::span<const Eigen::Vector2d> polygon) const;

  /// m^2 for a unit of barycentric area: twice the triangle's area.
  double space() const { return space_; }

  /// Zero everywhere.
  bool is_blank() const { return kind_ == kConstant && tone_ == 0; }

 private:
  friend class ToneField;
  enum Kind : std::uint8_t { kConstant, kColors, kTexels };

  ToneIntegral integrate_texels(std::span<const Eigen::Vector2d> polygon) const;

  Kind kind_ = kConstant;
  std::uint32_t triangle_ = 0;
  const ToneField* field_ = nullptr;
  double space_ = 0;
  bool is_wanted_asked_ = false;
  double tone_ = 0;  ///< of kConstant
  // Of kTexels:
  const ToneLayer* layer_ = nullptr;
  TexelAddressing addressing_;
  Eigen::Vector2d origin_ = Eigen::Vector2d::Zero();                             ///< texel of corner 0
  Eigen::Vector2d e1_ = Eigen::Vector2d::Zero(), e2_ = Eigen::Vector2d::Zero();  ///< to corners 1 and 2
  double per_determinant_ = 0;                                                   ///< of e1_ and e2_
};

}  // namespace hilbrush
