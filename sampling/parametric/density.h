#pragma once
#include "sampling/parametric/parametric.h"

/// Densities for the adaptive curve.
namespace hilbrush {

/// A ParametricDensity on a surface, with their means from a coarse grid. Thread-safe.
class DensityOnSurface {
 public:
  /// Keeps a reference to `surface`. Cost: a grid of 256 x 256 places.
  DensityOnSurface(const ParametricSurface& surface, ParametricDensity density);

  double at(const Eigen::Vector2d& uv) const;
  bool is_constant() const { return density_ == ParametricDensity::kConstant; }

  double area() const { return area_; }  ///< of the surface, by the grid
  double mean() const { return mean_; }  ///< of the density over the area, by the grid

 private:
  double unclipped(const Eigen::Vector2d& uv) const;

  const ParametricSurface& surface_;
  ParametricDensity density_;
  double largest_ = 0;  ///< curvature is clipped here
  double area_ = 0;
  double mean_ = 0;
};

}  // namespace hilbrush
