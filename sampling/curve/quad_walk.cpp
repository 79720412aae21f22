#include "sampling/curve/quad_walk.h"

#include <algorithm>

namespace hilbrush {

template <class Curve>
const typename QuadWalk<Curve>::Held& QuadWalk<Curve>::heaviest(const Node& node) const {
  return held_[*std::max_element(node.pieces.begin(), node.pieces.end(), [&](std::uint32_t a, std::uint32_t c) {
    return held_[a].integral.mass < held_[c].integral.mass;
  })];
}

template <class Curve>
void QuadWalk<Curve>::push_pieces(const QuadMass& quad, const BaseQuad& base, Node& node) {
  const Chart& chart = mass_.chart_of(quad);
  const std::span<const PieceMass> pieces = mass_.pieces_of(quad);
  held_count_ = 0;
  roots_.clear();
  for (std::uint32_t i = 0; i < base.face_count; ++i) {
    if (!(pieces[i].mass > 0)) continue;
    roots_.push_back(static_cast<std::uint32_t>(held_count_));
    Held& held = push();
    held.frame = i;
    held.piece = whole_piece<kDimensions>(chart, mass_.mesh(), chart.face_of(base, i));
    clip_to_box<kDimensions>(held.piece, node.low, node.size);
    held.integral = pieces[i].integral(held.piece.area_b() * frame(i).space);
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
    squares += frame(held.frame).density * held.integral.square;
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
    const auto upper = static_cast<std::uint32_t>(held_count_ - 1);
    distribute(node, upper - 1, axis + 1, place + part * stride, stride * Curve::kSide, children);
    piece = upper;
  }
  distribute(node, piece, axis + 1, place + part * stride, stride * Curve::kSide, children);
}

template <class Curve>
typename QuadWalk<Curve>::Held& QuadWalk<Curve>::push() {
  if (held_count_ == held_.size()) held_.resize(2 * held_count_ + 64);
  return held_[held_count_++];
}

/// Puts the lower and the upper part of a piece on the stack. One of their integrals is what the other leaves.
template <class Curve>
void QuadWalk<Curve>::halve(std::uint32_t index, int axis, double at) {
  push();
  Held& upper = push();
  Held& lower = held_[held_count_ - 2];
  const Held& whole = held_[index];
  lower.frame = upper.frame = whole.frame;
  cut_piece(whole.piece, axis, at, lower.piece, upper.piece);
  const bool is_lower_smaller = lower.piece.area_b() < upper.piece.area_b();
  Held& smaller = is_lower_smaller ? lower : upper;
  Held& larger = is_lower_smaller ? upper : lower;
  smaller.integral = integrate(store_.tone_on(*frames_[whole.frame]), smaller.piece);
  const ToneIntegral &all = whole.integral, &part = smaller.integral;
  larger.integral = {all.area_m2 - part.area_m2, all.mass - part.mass, all.first - part.first,
                     std::max(0., all.square - part.square)};
  if (larger.integral.mass < kRoundingShare * all.mass) larger.integral = {};
}

template class QuadWalk<HilbertQuad>;
template class QuadWalk<PeanoQuad>;
template class QuadWalk<HilbertCube>;

}  // namespace hilbrush
