#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

namespace hilbrush {

/// Cuts one polygon in space, convex or not, nearly planar or degenerate, into its n - 2 triangles.
class PolygonCutter {
 public:
  using Triangle = std::array<std::size_t, 3>;

  /// `corners` in order; the triangles index it and keep its orientation. A convex polygon is fanned, any
  /// other has its ears cut (Meisters 1975) in the plane of its Newell normal. Where rounding or
  /// self-crossing leaves no ear, the rest is fanned. The result is valid until the next call. Cost: O(n)
  /// convex, else O(n r) with r reflex corners, bounded by `kWorkLimit`.
  const std::vector<Triangle>& cut(const std::vector<Eigen::Vector3d>& corners);

  /// Polygons that were too large to cut properly and were fanned.
  std::size_t given_up() const { return given_up_; }

 private:
  void project(const std::vector<Eigen::Vector3d>& corners);
  bool is_convex() const;
  void cut_ears();
  bool is_ear(std::size_t corner) const;
  void fan_rest(std::size_t start, std::size_t count);

  std::vector<Eigen::Vector2d> flat_;
  std::vector<std::size_t> next_;
  std::vector<std::size_t> previous_;
  std::vector<std::size_t> reflex_;
  std::vector<Triangle> triangles_;
  double min_turn_ = 0;
  std::size_t given_up_ = 0;
  mutable std::size_t work_ = 0;
};

}  // namespace hilbrush
