#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sampling/curve/curve_mass.h"
#include "sampling/curve/dot_triangle.h"

/// What a stratum gathers from the patches that it is made of, until it is known where its dot goes.
namespace hilbrush {

/// `b`: the shares of the second and the third corner.
inline SurfacePoint point_in_triangle(std::uint32_t triangle, const Eigen::Vector2d& b) {
  return {triangle, {1 - b.x() - b.y(), b.x(), b.y()}};
}

/// The share of a stratum on one chart: a stratum that spans two charts puts its dot on one of them.
struct StratumPart {
  std::uint32_t chart = 0;
  double mass = 0;
  Eigen::Vector3d moment_O = Eigen::Vector3d::Zero();  ///< mass times place

  /// The one triangle it lies in, and mass times place there; kNoTriangle if there are several.
  std::uint32_t triangle = kNoTriangle;
  Eigen::Vector2d moment_b = Eigen::Vector2d::Zero();

  /// The center of its heaviest bit, and the polygon that this is the center of (empty: the bit is all painted).
  double heaviest_mass = 0;
  SurfacePoint heaviest;
  std::array<Eigen::Vector2d, 12> polygon;
  std::size_t polygon_size = 0;
  /// ... or, if the heaviest bit is a whole base quad, that; and the run of whole base quads around it.
  static constexpr std::size_t kNoQuad = ~std::size_t{0};
  std::size_t heaviest_quad = kNoQuad, first_quad = 0, last_quad = 0;

  void clear() {
    mass = heaviest_mass = 0;
    moment_O.setZero();
    moment_b.setZero();
    triangle = kNoTriangle;
    polygon_size = 0;
    heaviest_quad = kNoQuad;
  }
};

class Stratum {
 public:
  void clear() {
    current_.clear();
    best_.clear();
  }
  bool is_empty() const { return !(current_.mass > 0) && !(best_.mass > 0); }

  /// The part on `chart`, to be added to.
  StratumPart& on(std::uint32_t chart) {
    if (current_.chart != chart) {
      if (current_.mass > best_.mass) best_ = current_;
      current_.clear();
      current_.chart = chart;
    }
    return current_;
  }
  const StratumPart& heaviest() const { return current_.mass >= best_.mass ? current_ : best_; }

 private:
  StratumPart current_, best_;
};

/// No stratum's mass is such that a place which asks for so much is blank beside it.
bool is_surely_painted(double asked);

/// A surface point, and the tone that is asked for there.
struct PaintedPoint {
  SurfacePoint point;
  double asked = 0;
};

/// The stratum's center of mass, put back on the surface; where that is blank, a painted point of its heaviest bit.
PaintedPoint center_on_surface(const CurveMass& mass, DotTriangles& triangles, const StratumPart& part);

/// A painted point of a base quad that has mass, in the triangle that has most.
SurfacePoint heaviest_point(const CurveMass& mass, std::size_t quad);

}  // namespace hilbrush
