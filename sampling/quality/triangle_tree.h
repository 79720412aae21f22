#pragma once
#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include "sampling/model/textured_mesh.h"

/// The triangles of a mesh in a balanced tree of boxes: finds the part of the surface within a ball and its
/// nearest point.
namespace hilbrush {

class TriangleTree {
 public:
  /// Keeps a reference to `mesh`. `masses` has one value for each triangle, see mass_within. Cost O(n log n).
  TriangleTree(const TexturedMesh& mesh, std::span<const double> masses);

  /// Sum of the masses of the triangles within the ball; for those that are only partly in it,
  /// `partly(triangle)` is added.
  template <class Partly>
  double mass_within(const Eigen::Vector3d& center, double radius, const Partly& partly) const {
    return mass_below({center, radius}, partly, 0, 0, order_.size());
  }

  /// Calls visit(triangle) for all triangles whose boxes the ball touches.
  template <class Visit>
  void visit_near(const Eigen::Vector3d& center, double radius, const Visit& visit) const {
    mass_within(center, radius, [&](std::uint32_t triangle) {
      visit(triangle);
      return 0.;
    });
  }

  SurfacePoint nearest(const Eigen::Vector3d& place) const;

 private:
  struct Node {
    Eigen::AlignedBox3d box;
    double mass = 0;
  };
  struct Sphere {
    Eigen::Vector3d center;
    double radius;
  };
  struct Candidate {
    SurfacePoint point;
    double distance2;
  };
  static constexpr std::size_t kLeafSize = 4;

  bool is_leaf(std::size_t node) const { return 2 * node + 1 >= nodes_.size(); }
  void build(std::span<const double> masses, std::size_t node, std::size_t begin, std::size_t end);
  void search(const Eigen::Vector3d& place, std::size_t node, std::size_t begin, std::size_t end,
              Candidate& best) const;

  static double farthest2(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& from) {
    return (from - box.min()).cwiseMax(box.max() - from).squaredNorm();
  }

  template <class Partly>
  double mass_below(const Sphere& sphere, const Partly& partly, std::size_t node, std::size_t begin,
                    std::size_t end) const {
    const double radius2 = sphere.radius * sphere.radius;
    if (begin == end || nodes_[node].box.squaredExteriorDistance(sphere.center) >= radius2) return 0;
    if (farthest2(nodes_[node].box, sphere.center) <= radius2) return nodes_[node].mass;
    if (is_leaf(node)) {
      double sum = 0;
      for (std::size_t i = begin; i < end; ++i) sum += partly(order_[i]);
      return sum;
    }
    const std::size_t middle = begin + (end - begin) / 2;
    return mass_below(sphere, partly, 2 * node + 1, begin, middle) +
           mass_below(sphere, partly, 2 * node + 2, middle, end);
  }

  const TexturedMesh& mesh_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;  ///< a heap: the children of node n are 2n + 1 and 2n + 2
};

}  // namespace hilbrush
