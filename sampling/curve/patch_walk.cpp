#include "sampling/curve/patch_walk.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hilbrush {
namespace {

/// Quads get no smaller than this; what is still too much for one patch goes on in space.
constexpr int kDeepestQuad = 40;
constexpr int kDeepestCube = 40;

struct Node {
  Box box;
  std::vector<Piece> pieces;
  std::vector<ToneIntegral> integrals;
  double mass = 0;
};

class Walk {
 public:
  Walk(std::uint32_t sheet, const ToneField& tone, const PatchRule& rule, const PatchVisitor& visit)
      : sheet_(sheet), tone_(tone), rule_(rule), visit_(visit) {}

  void integrate_pieces(Node& node) const {
    node.integrals.clear();
    node.mass = 0;
    std::size_t kept = 0;
    for (const Piece& piece : node.pieces) {
      const ToneIntegral integral = integrate(tone_, piece);
      if (!(integral.mass > 0)) continue;
      node.pieces[kept++] = piece;
      node.integrals.push_back(integral);
      node.mass += integral.mass;
    }
    node.pieces.resize(kept);
  }

  static void scale_to(Node& node, double mass) {
    const double factor = node.mass > 0 ? mass / node.mass : 0;
    for (ToneIntegral& integral : node.integrals) {
      integral.mass *= factor;
      integral.first *= factor;
    }
    node.mass = mass;
  }

  template <class Hilbert>
  void walk(Node& node, Hilbert hilbert, int depth) {
    if (!(node.mass > 0) || node.pieces.empty()) return;
    constexpr bool kIsQuad = Hilbert::kChildCount == 4;
    const bool is_small = node.mass <= rule_.dot_mass / rule_.omega;
    const bool is_uniform = !is_small && kIsQuad && is_even_on_square(node);
    if (is_small || is_uniform || (!kIsQuad && depth == kDeepestCube)) return hand_on(node, hilbert, is_uniform);
    if (kIsQuad && depth == kDeepestQuad) return walk_in_space(node);

    auto pieces = cut_into_children<Hilbert::kChildCount>(node.pieces, node.box.middle());
    std::array<Node, Hilbert::kChildCount> children;
    double sum = 0;
    for (unsigned i = 0; i < Hilbert::kChildCount; ++i) {
      const unsigned place = hilbert.place(i);
      children[i].box = node.box.child(place);
      children[i].pieces = std::move(pieces[place]);
      integrate_pieces(children[i]);
      sum += children[i].mass;
    }
    if (!(sum > 0)) return hand_on(node, hilbert, false);
    for (unsigned i = 0; i < Hilbert::kChildCount; ++i) {
      scale_to(children[i], children[i].mass * node.mass / sum);
      walk(children[i], hilbert.child(i), depth + 1);
    }
  }

 private:
  /// sigma of the mass on the square, times its area, bounds the mass that an even spread would misplace (E|t - mean|
  /// <= sigma).
  bool is_even_on_square(const Node& node) const {
    const double area = node.box.size * node.box.size;
    double squares = 0;
    for (std::size_t i = 0; i < node.pieces.size(); ++i) {
      const double place_area = area_on_square(node.pieces[i]);
      if (!(place_area > 0)) return false;
      squares += node.integrals[i].area_m2 / place_area * node.integrals[i].square;
    }
    const double misplaced2 = squares * area - node.mass * node.mass;
    const double allowed = rule_.dot_mass / rule_.omega;
    return misplaced2 <= allowed * allowed;
  }

  template <class Hilbert>
  void hand_on(const Node& node, Hilbert hilbert, bool is_uniform) const {
    Patch patch;
    patch.sheet = sheet_;
    patch.box = node.box;
    if constexpr (Hilbert::kChildCount == 4) {
      patch.quad = hilbert;
    } else {
      patch.cube = hilbert;
      patch.is_in_space = true;
    }
    patch.is_uniform = is_uniform;
    patch.mass = node.mass;
    patch.pieces = node.pieces;
    patch.integrals = node.integrals;
    visit_(patch);
  }

  /// A quad that is tiny on the square but still holds much mass (a part that the map has shrunk to nothing) is walked
  /// by a curve in space instead.
  void walk_in_space(Node& node) {
    Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
    for (Piece& piece : node.pieces)
      for (std::uint32_t i = 0; i < piece.corner_count; ++i) {
        PieceCorner& corner = piece.corners[i];
        corner.place = position(tone_.mesh(), {piece.triangle, {1 - corner.b.sum(), corner.b.x(), corner.b.y()}});
        low = low.cwiseMin(corner.place);
        high = high.cwiseMax(corner.place);
      }
    const double size = (high - low).maxCoeff() * (1 + 1e-9);
    node.box = {.5 * (low + high) - Eigen::Vector3d::Constant(size / 2), size};
    walk(node, HilbertCube{}, 0);
  }

  std::uint32_t sheet_;
  const ToneField& tone_;
  const PatchRule& rule_;
  const PatchVisitor& visit_;
};

}  // namespace

void walk_patches(const Sheet& sheet, std::uint32_t sheet_index, const BaseQuad& quad, const ToneField& tone,
                  const PatchRule& rule, double mass, const PatchVisitor& visit) {
  Walk walk(sheet_index, tone, rule, visit);
  Node node;
  node.box = quad.box;
  sheet.pieces_of(quad, node.pieces);
  walk.integrate_pieces(node);
  walk.scale_to(node, mass);
  if (sheet.is_on_square)
    walk.walk(node, quad.quad, 0);
  else
    walk.walk(node, quad.cube, 0);
}

double mass_of(const Sheet& sheet, const BaseQuad& quad, const ToneField& tone) {
  std::vector<Piece> pieces;
  sheet.pieces_of(quad, pieces);
  double mass = 0;
  for (const Piece& piece : pieces) mass += integrate(tone, piece).mass;
  return mass;
}

}  // namespace hilbrush
