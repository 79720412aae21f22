#include "sampling/curve/quad_walk.h"

#include <algorithm>

namespace hilbrush {

FaceFrame::FaceFrame(const Sheet& sheet, const TexturedMesh& mesh, const SheetFace& face)
    : triangle(face.triangle),
      origin_O(mesh.corner(face.triangle, 0)),
      e1_O(mesh.corner(face.triangle, 1) - origin_O),
      e2_O(mesh.corner(face.triangle, 2) - origin_O),
      place(face.places[0]) {
  const auto corners = sheet.corners_b(face);
  b = corners[0];
  face_to_b.col(0) = corners[1] - corners[0];
  face_to_b.col(1) = corners[2] - corners[0];
  const Eigen::Vector2d u = face.places[1] - place, v = face.places[2] - place;
  const double determinant = u.x() * v.y() - u.y() * v.x();
  to_face << v.y(), -v.x(), -u.y(), u.x();
  to_face *= 1 / determinant;
  space = e1_O.cross(e2_O).norm();
  density = std::abs(face_to_b.determinant() / determinant) * space;
}

template <class Curve>
const typename QuadWalk<Curve>::Held& QuadWalk<Curve>::heaviest(const Node& node) const {
  return held_[*std::max_element(node.pieces.begin(), node.pieces.end(), [&](std::uint32_t a, std::uint32_t c) {
    return held_[a].integral.mass < held_[c].integral.mass;
  })];
}

template <class Curve>
void QuadWalk<Curve>::hold_pieces(const QuadMass& quad, const BaseQuad& base, Node& node) {
  const Sheet& sheet = mass_.sheet_of(quad);
  const PieceMass* pieces = mass_.pieces_of(quad);
  tones_.clear();
  held_.clear();
  roots_.clear();
  for (std::uint32_t i = 0; i < base.face_count; ++i) {
    const SheetFace& face = sheet.face_of(base, i);
    tones_.push_back(mass_.tone.on(face.triangle));
    if (!(pieces[i].mass > 0)) continue;
    Held held;
    held.frame = i;
    held.integral = pieces[i].integral();
    held.piece = whole_piece<kDimensions>(sheet, mass_.curve.mesh, face);
    clip_to_box<kDimensions>(held.piece, node.low, node.size);
    held.integral.area_m2 = held.piece.area_b() * frames_[i].space;
    roots_.push_back(static_cast<std::uint32_t>(held_.size()));
    held_.push_back(held);
  }
  node.pieces = roots_;
}

/// sigma of the mass on the square, times its area, bounds the mass that an even spread would misplace (E|t - mean| <=
/// sigma).
template <class Curve>
bool QuadWalk<Curve>::is_even(const Node& node) const {
  double squares = 0, mass = 0;
  for (const auto index : node.pieces) {
    const Held& held = held_[index];
    squares += frames_[held.frame].density * held.integral.square;
    mass += held.integral.mass;
  }
  return squares * node.size * node.size - mass * mass <= rule_.small_mass() * rule_.small_mass();
}

template <class Curve>
void QuadWalk<Curve>::cut_into_children(const Node& node, std::vector<std::vector<std::uint32_t>>& children) {
  for (auto& child : children) child.clear();
  for (const auto piece : node.pieces) distribute(node, piece, 0, 0, 1, children);
}

template <class Curve>
void QuadWalk<Curve>::distribute(const Node& node, std::uint32_t piece, int axis, unsigned place, unsigned stride,
                                 std::vector<std::vector<std::uint32_t>>& children) {
  if (!(held_[piece].integral.mass > 0)) return;
  if (axis == kDimensions) return children[place].push_back(piece);
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const auto& corner : held_[piece].piece.all()) {
    low = std::min(low, corner.place[axis]);
    high = std::max(high, corner.place[axis]);
  }
  unsigned part = 0;
  for (; part + 1 < Curve::kSide; ++part) {
    const double at = node.low[axis] + node.size * (part + 1) / Curve::kSide;
    if (high <= at) break;
    if (low >= at) continue;
    halve(piece, axis, at);
    const auto upper = static_cast<std::uint32_t>(held_.size() - 1);
    distribute(node, upper - 1, axis + 1, place + part * stride, stride * Curve::kSide, children);
    piece = upper;
  }
  distribute(node, piece, axis + 1, place + part * stride, stride * Curve::kSide, children);
}

/// Puts the lower and the upper part of a piece on the stack. One of their integrals is what the other leaves.
template <class Curve>
void QuadWalk<Curve>::halve(std::uint32_t index, int axis, double at) {
  const Held& whole = held_[index];
  Held lower, upper;
  lower.frame = upper.frame = whole.frame;
  cut_piece(whole.piece, axis, at, lower.piece, upper.piece);
  const bool is_lower_smaller = lower.piece.area_b() < upper.piece.area_b();
  Held& smaller = is_lower_smaller ? lower : upper;
  Held& larger = is_lower_smaller ? upper : lower;
  smaller.integral = integrate(tones_[whole.frame], smaller.piece);
  const ToneIntegral &all = whole.integral, &part = smaller.integral;
  larger.integral = {all.area_m2 - part.area_m2, all.mass - part.mass, all.first - part.first,
                     std::max(0., all.square - part.square)};
  if (larger.integral.mass < kRoundingShare * all.mass) larger.integral = {};
  held_.push_back(lower);
  held_.push_back(upper);
}

template class QuadWalk<HilbertQuad>;
template class QuadWalk<PeanoQuad>;
template class QuadWalk<HilbertCube>;

}  // namespace hilbrush
