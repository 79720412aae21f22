#pragma once
#include <Eigen/Geometry>
#include <cmath>
#include <optional>
#include <vector>

#include "sampling/parametric/adaptive_curve.h"

/// Area and mass that belong to a vertex of the adaptive curve (the thesis, section 4.3).
namespace hilbrush {

inline double triangle_area(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  return .5 * (b - a).cross(c - a).norm();
}

/// (b) Of the leaf's four corners, as two triangles.
template <class Quad>
double square_area(const ParametricSurface& surface, const Node<Quad>& leaf) {
  const auto corner = [&](unsigned k) {
    return leaf.has_grid ? leaf.grid[k] : surface.position(leaf.grid_uv(k));
  };
  const Eigen::Vector3d a = corner(0);
  const Eigen::Vector3d b = corner(2);
  const Eigen::Vector3d c = corner(8);
  const Eigen::Vector3d d = corner(6);
  return triangle_area(a, b, c) + triangle_area(a, c, d);
}

/// (c) By the first fundamental form at the vertex; (b) where that is singular.
template <class Quad>
double form_area(const ParametricSurface& surface, const Node<Quad>& leaf) {
  const double element = surface.area_element(leaf.center_uv());
  return std::isfinite(element) ? element * leaf.size() * leaf.size() : square_area(surface, leaf);
}

/// The area that belongs to a vertex of the curve, and the place whose density is used for it.
struct VertexArea {
  double area = 0;
  Eigen::Vector2d density_uv;
};

/// Walks the leaves of a node and calls visit(leaf, VertexArea) for each. Method (a) uses the vertices before
/// and after, also beyond the ends of the node; the first and the last vertex of the curve have no triangle
/// and no area.
template <class Quad>
class AreaWalk {
 public:
  using NodeType = Node<Quad>;

  AreaWalk(const ParametricSurface& surface, const AdaptiveCurve<Quad>& curve,
           const std::vector<NodeType>& nodes, AreaMethod method)
      : surface_(surface), curve_(curve), nodes_(nodes), method_(method) {}

  template <class Visit>
  void walk(std::size_t index, Visit&& visit) const {
    NodeType node = nodes_[index];
    switch (method_) {
      case AreaMethod::kTriangle:
        return walk_triangles(index, visit);
      case AreaMethod::kSquare:
        return curve_.walk(node, [&](const NodeType& leaf) {
          visit(leaf, VertexArea{square_area(surface_, leaf), leaf.center_uv()});
        });
      case AreaMethod::kFirstFundamentalForm:
        return curve_.walk(node, [&](const NodeType& leaf) {
          visit(leaf, VertexArea{form_area(surface_, leaf), leaf.center_uv()});
        });
    }
  }

 private:
  struct Vertex {
    Eigen::Vector2d uv;
    Eigen::Vector3d position;
  };

  Vertex vertex(const NodeType& leaf) const {
    return {leaf.center_uv(), surface_.position(leaf.center_uv())};
  }

  static VertexArea area_of(const Vertex& a, const Vertex& b, const Vertex& c) {
    return {triangle_area(a.position, b.position, c.position), (a.uv + b.uv + c.uv) / 3};
  }

  /// Leaves are visited one step late, when the vertex after them is known.
  template <class Visit>
  void walk_triangles(std::size_t index, Visit&& visit) const {
    std::optional<Vertex> before, current;
    NodeType waiting;
    if (index > 0) before = vertex(curve_.end_leaf(nodes_[index - 1], true));
    const auto pass = [&](const std::optional<Vertex>& next) {
      if (current) {
        const bool is_inside = before && next;
        visit(waiting, is_inside ? area_of(*before, *current, *next) : VertexArea{0, current->uv});
        before = current;
      }
      current = next;
    };
    NodeType node = nodes_[index];
    curve_.walk(node, [&](const NodeType& leaf) {
      pass(vertex(leaf));
      waiting = leaf;
    });
    pass(index + 1 < nodes_.size() ? std::optional(vertex(curve_.end_leaf(nodes_[index + 1], false)))
                                   : std::nullopt);
  }

  const ParametricSurface& surface_;
  const AdaptiveCurve<Quad>& curve_;
  const std::vector<NodeType>& nodes_;
  AreaMethod method_;
};

}  // namespace hilbrush
