#pragma once
#include <array>
#include <cmath>
#include <vector>

#include "sampling/parametric/density.h"

/// The adaptive curve over the unit square of a parametric surface (the thesis, figure 4.6), walked without
/// keeping it.
namespace hilbrush {

/// When a quad is divided.
struct DivisionRule {
  int minimum_depth = 0;
  int maximum_depth = 0;
  double largest_reach = 0;  ///< distance on the surface from a quad's center to its corners and mid-sides
};

/// A square of the parameter domain: column x and row y of side_count^2 equal ones.
template <class Quad>
struct Node {
  std::uint64_t x = 0;
  std::uint64_t y = 0;
  std::uint64_t side_count = 1;
  int depth = 0;
  Quad quad;
  bool has_grid = false;
  std::array<Eigen::Vector3d, 9>
      grid;  ///< positions of corners, mid-sides and center, row by row, if has_grid

  double size() const { return 1 / static_cast<double>(side_count); }
  /// The place at the shares `right` and `up` (0 to 1) of the square, from its lower left corner.
  Eigen::Vector2d uv(double right, double up) const {
    return Eigen::Vector2d(static_cast<double>(x) + right, static_cast<double>(y) + up) /
           static_cast<double>(side_count);
  }
  Eigen::Vector2d center_uv() const { return uv(.5, .5); }
  /// The place of grid[k].
  Eigen::Vector2d grid_uv(unsigned k) const {
    const unsigned column = k % 3;
    const unsigned row = k / 3;
    return uv(.5 * column, .5 * row);
  }
};

template <class Quad>
class AdaptiveCurve {
 public:
  using NodeType = Node<Quad>;

  AdaptiveCurve(const ParametricSurface& surface, const DensityOnSurface& density, const DivisionRule& rule)
      : surface_(surface), density_(density), rule_(rule) {}

  /// The nodes of one depth, at most the minimum depth, in order of the curve: units of work for threads.
  std::vector<NodeType> nodes_at(int depth) const {
    std::vector<NodeType> nodes{NodeType{}};
    for (int d = 0; d < depth; ++d) {
      std::vector<NodeType> finer;
      for (const NodeType& node : nodes)
        for (unsigned i = 0; i < Quad::kChildCount; ++i) finer.push_back(child(node, i));
      nodes = std::move(finer);
    }
    return nodes;
  }

  /// Calls visit(leaf) for all leaves below a node, in order.
  template <class Visit>
  void walk(NodeType& node, Visit&& visit) const {
    if (!is_divided(node)) return visit(node);
    FineGrid fine;
    if (node.has_grid) fine = fine_grid(node);
    for (unsigned i = 0; i < Quad::kChildCount; ++i) {
      NodeType next = child(node, i);
      if (node.has_grid) take_grid(next, node, fine);
      walk(next, visit);
    }
  }

  /// The first or the last leaf below a node.
  NodeType end_leaf(NodeType node, bool is_last) const {
    while (is_divided(node)) {
      NodeType next = child(node, is_last ? Quad::kChildCount - 1 : 0);
      if (node.has_grid) take_grid(next, node, fine_grid(node));
      node = next;
    }
    return node;
  }

 private:
  static constexpr unsigned kSide = Quad::kSide;
  /// Positions at the corners, mid-sides and centers of all children.
  static constexpr unsigned kFineSide = 2 * kSide + 1;
  using FineGrid = std::array<Eigen::Vector3d, kFineSide * kFineSide>;

  static NodeType child(const NodeType& node, unsigned i) {
    const unsigned place = node.quad.slot(i);
    NodeType next;
    next.x = kSide * node.x + place % kSide;
    next.y = kSide * node.y + place / kSide;
    next.side_count = kSide * node.side_count;
    next.depth = node.depth + 1;
    next.quad = node.quad.child(i);
    return next;
  }

  bool is_divided(NodeType& node) const {
    if (node.depth < rule_.minimum_depth) return true;
    if (node.depth >= rule_.maximum_depth) return false;
    if (!node.has_grid) {
      for (unsigned k = 0; k < 9; ++k) node.grid[k] = surface_.position(node.grid_uv(k));
      node.has_grid = true;
    }
    double reach2 = 0;
    for (const Eigen::Vector3d& p : node.grid) reach2 = std::max(reach2, (p - node.grid[4]).squaredNorm());
    const double limit2 = rule_.largest_reach * rule_.largest_reach;
    return reach2 > limit2 ||
           (!density_.is_constant() && reach2 * density_.at(node.center_uv()) > limit2 * density_.mean());
  }

  FineGrid fine_grid(const NodeType& node) const {
    FineGrid fine;
    for (unsigned j = 0; j < kFineSide; ++j)
      for (unsigned i = 0; i < kFineSide; ++i)
        fine[j * kFineSide + i] = i % kSide == 0 && j % kSide == 0
                                      ? node.grid[j / kSide * 3 + i / kSide]
                                      : surface_.position(node.uv(i / (2. * kSide), j / (2. * kSide)));
    return fine;
  }

  static void take_grid(NodeType& child, const NodeType& parent, const FineGrid& fine) {
    const auto column = static_cast<unsigned>(child.x - kSide * parent.x);
    const auto row = static_cast<unsigned>(child.y - kSide * parent.y);
    for (unsigned k = 0; k < 9; ++k) child.grid[k] = fine[(2 * row + k / 3) * kFineSide + 2 * column + k % 3];
    child.has_grid = true;
  }

  const ParametricSurface& surface_;
  const DensityOnSurface& density_;
  DivisionRule rule_;
};

}  // namespace hilbrush
