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

/// Dots, and how far they are from a place on their surface.
namespace hilbrush {

/// Distance is the radius at which a ball around the place holds a way along the surface to the dot (growing_ball.h):
/// as far as it looks over folds and bumps, and around the rim to the far side of a thin wall. No less than the
/// straight distance, no more than the way along the surface; it rises no faster than the place moves.
class DotsOnSurface {
 public:
  /// Keeps references to mesh and neighbors. Cost O(n log n).
  DotsOnSurface(const TexturedMesh& mesh, const Neighbors& neighbors, std::span<const Dot> dots);

  static constexpr std::uint32_t kNone = PointTree<3>::kNone;

  /// To the nearest dot but one; to the straight nearest of other components if its own has none. Thread-safe.
  /// Cost O(log n + triangles that the ball meets).
  double distance(const Eigen::Vector3d& place_O, std::uint32_t triangle, std::uint32_t but = kNone) const;

 private:
  PointTree<3> tree_;
  std::vector<std::uint32_t> triangles_;  ///< of each dot
  mutable tbb::enumerable_thread_specific<GrowingBall> balls_;
};

}  // namespace hilbrush
