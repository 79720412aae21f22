#include "sampling/quality/triangle_tree.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

#include "sampling/base/check.h"
#include "sampling/model/nearest_in_triangle.h"

namespace hilbrush {
namespace {

using Eigen::Vector3d;

Eigen::AlignedBox3d box_of(const TexturedMesh& mesh, std::uint32_t triangle) {
  Eigen::AlignedBox3d box;
  for (int c = 0; c < 3; ++c) box.extend(mesh.corner(triangle, c));
  return box;
}

}  // namespace

TriangleTree::TriangleTree(const TexturedMesh& mesh, std::span<const double> masses)
    : mesh_(mesh), order_(mesh.triangle_count()) {
  CHECK_EQ(masses.size(), order_.size());
  std::iota(order_.begin(), order_.end(), 0u);
  std::size_t leaf_count = 1;
  while (leaf_count * kLeafSize < order_.size()) leaf_count *= 2;
  nodes_.resize(2 * leaf_count - 1);
  build(masses, 0, 0, order_.size());
}

void TriangleTree::build(std::span<const double> masses, std::size_t node, std::size_t begin,
                         std::size_t end) {
  Eigen::AlignedBox3d middles;
  for (std::size_t i = begin; i < end; ++i) {
    const Eigen::AlignedBox3d box = box_of(mesh_, order_[i]);
    nodes_[node].box.extend(box);
    middles.extend(box.center());
  }
  if (is_leaf(node)) {
    for (std::size_t i = begin; i < end; ++i) nodes_[node].mass += masses[order_[i]];
    return;
  }
  const std::size_t middle = begin + (end - begin) / 2;
  if (begin < end) {
    int axis = 0;
    middles.sizes().maxCoeff(&axis);
    const auto key = [&](std::uint32_t triangle) { return box_of(mesh_, triangle).center()[axis]; };
    std::nth_element(order_.begin() + static_cast<std::ptrdiff_t>(begin),
                     order_.begin() + static_cast<std::ptrdiff_t>(middle),
                     order_.begin() + static_cast<std::ptrdiff_t>(end),
                     [&](std::uint32_t a, std::uint32_t b) {
                       const double ka = key(a);
                       const double kb = key(b);
                       return ka < kb || (ka == kb && a < b);
                     });
  }
  build(masses, 2 * node + 1, begin, middle);
  build(masses, 2 * node + 2, middle, end);
  nodes_[node].mass = nodes_[2 * node + 1].mass + nodes_[2 * node + 2].mass;
}

SurfacePoint TriangleTree::nearest(const Vector3d& place) const {
  Candidate best{{}, std::numeric_limits<double>::infinity()};
  search(place, 0, 0, order_.size(), best);
  return best.point;
}

void TriangleTree::search(const Vector3d& place, std::size_t node, std::size_t begin, std::size_t end,
                          Candidate& best) const {
  if (is_leaf(node)) {
    for (std::size_t i = begin; i < end; ++i) {
      const SurfacePoint point{
          order_[i], nearest_in_triangle(place, mesh_.corner(order_[i], 0), mesh_.corner(order_[i], 1),
                                         mesh_.corner(order_[i], 2))};
      const double distance2 = (position(mesh_, point) - place).squaredNorm();
      if (distance2 < best.distance2) best = {point, distance2};
    }
    return;
  }
  const std::size_t middle = begin + (end - begin) / 2;
  const std::array<std::size_t, 3> ends{begin, middle, end};
  std::array<double, 2> far{};
  for (std::size_t side = 0; side < 2; ++side)
    far[side] = ends[side] == ends[side + 1] ? std::numeric_limits<double>::infinity()
                                             : nodes_[2 * node + 1 + side].box.squaredExteriorDistance(place);
  const std::size_t first = far[1] < far[0] ? 1 : 0;
  for (const std::size_t side : {first, 1 - first})
    if (far[side] < best.distance2) search(place, 2 * node + 1 + side, ends[side], ends[side + 1], best);
}

}  // namespace hilbrush
