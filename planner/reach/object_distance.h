#pragma once
#include <Eigen/Core>
#include <vector>

#include "sampling/model/textured_mesh.h"

/// Distance to the object's surface on a grid, so that a clearance test of a sphere costs one interpolation.
/// Exact distances at the nodes, to the spacing of the points that stand for the surface: within error_m() of
/// the truth anywhere farther than a few grid steps from it. Unsigned: inside and outside are alike.
namespace hilbrush {

class ObjectDistance {
 public:
  /// Distances are kept up to `range_m`. Cost: O(nodes + surface / step^2), about .1 s and 4 MB for an object
  /// of 100 mm.
  ObjectDistance(const TexturedMesh& mesh, double range_m);

  /// At most range_m(); range_m() itself outside the grid.
  double operator()(const Eigen::Vector3d& p_O) const;
  double range_m() const { return range_m_; }
  /// How much an interpolated distance of `radius_m` or more may be too large: interpolation across a step,
  /// and the gaps between the points that stand for the surface (none of it is farther than .6 of their
  /// spacing from one).
  double error_m(double radius_m) const {
    return (.375 * step_m_ * step_m_ + .18 * spacing_m_ * spacing_m_) / radius_m;
  }

 private:
  std::size_t index(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(size_.y()) + static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(size_.x()) +
           static_cast<std::size_t>(x);
  }
  void choose_grid(const TexturedMesh& mesh);
  /// Points on all triangles, spacing_m_ apart at most.
  std::vector<Eigen::Vector3f> surface_points(const TexturedMesh& mesh) const;
  void spread(const std::vector<Eigen::Vector3f>& points);

  double range_m_, step_m_ = 0, spacing_m_ = 0;
  Eigen::Vector3d low_O_;
  Eigen::Vector3i size_;
  std::vector<float> distance_m_;
};

}  // namespace hilbrush
