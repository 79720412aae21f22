#pragma once
#include <tbb/enumerable_thread_specific.h>

#include <cstdint>
#include <span>
#include <vector>

#include "sampling/dots/dots.h"
#include "sampling/model/edges.h"
#include "sampling/model/growing_ball.h"
#include "sampling/model/textured_mesh.h"
#include "sampling/quality/point_tree.h"

/// Distances from a place on a surface to dots on it.
namespace hilbrush {

/// The distance is the radius at which a ball around the place contains a path along the surface to the dot
/// (growing_ball.h): the straight distance across folds and bumps, but the one around the edge to the far
/// side of a thin wall. It is never less than the straight distance and never more than the path along the
/// surface, and it changes no faster than the place moves.
class DotsOnSurface {
 public:
  /// Keeps references to mesh and neighbors. Cost O(n log n).
  DotsOnSurface(const TexturedMesh& mesh, const Neighbors& neighbors, std::span<const Dot> dots);

  static constexpr std::uint32_t kNone = PointTree<3>::kNone;

  /// To the nearest dot except `but`; if the component has none, the straight distance to the nearest dot of
  /// the others. Thread-safe. Cost O(log n + triangles that the ball meets).
  double distance(const Eigen::Vector3d& place_O, std::uint32_t triangle, std::uint32_t but = kNone) const;

 private:
  PointTree<3> tree_;
  std::vector<std::uint32_t> triangles_;  ///< of each dot
  mutable tbb::enumerable_thread_specific<GrowingBall> balls_;
};

}  // namespace hilbrush
