#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sampling/curve/curve_mass.h"
#include "sampling/curve/dot_triangle.h"

/// What is summed over the patches of a stratum to find where its dot goes.
namespace hilbrush {

/// `b`: second and third barycentric coordinate.
inline SurfacePoint point_in_triangle(std::uint32_t triangle, const Eigen::Vector2d& b) {
  return {triangle, {1 - b.x() - b.y(), b.x(), b.y()}};
}

/// The part of a stratum on one chart: a stratum that spans several charts puts its dot on the heaviest part.
struct StratumPart {
  std::uint32_t chart = 0;
  double mass = 0;
  Eigen::Vector3d moment_O = Eigen::Vector3d::Zero();  ///< mass times position

  /// The one triangle it lies in, and mass times position there; kNoTriangle if there are several.
  std::uint32_t triangle = kNoTriangle;
  Eigen::Vector2d moment_b = Eigen::Vector2d::Zero();

  /// Of the patches and quads that it consists of, the heaviest: its center, and the polygon that this is the
  /// center of (empty: all of it is painted).
  double heaviest_mass = 0;
  SurfacePoint heaviest;
  std::array<Eigen::Vector2d, 12> polygon;
  std::size_t polygon_size = 0;
  /// If the heaviest is a whole base quad: this quad, and the run of whole base quads around it.
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

/// Whether a point that asks for this much cannot be blank, whatever the rest of its stratum asks for.
bool is_surely_painted(double asked);

/// A surface point, and the tone that is asked for there.
struct PaintedPoint {
  SurfacePoint point;
  double asked = 0;
};

/// The stratum's center of mass, projected to the surface; where that is blank, a painted point of its
/// heaviest piece.
PaintedPoint center_on_surface(const CurveMass& mass, DotTriangles& triangles, const StratumPart& part);

/// A painted point of a base quad that has mass, in its heaviest triangle.
SurfacePoint heaviest_point(const CurveMass& mass, std::size_t quad);

}  // namespace hilbrush
