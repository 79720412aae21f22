#include "sampling/curve/quad_walk.h"

#include <algorithm>

namespace hilbrush {

template <class Curve>
const typename QuadWalk<Curve>::MeasuredPiece& QuadWalk<Curve>::heaviest(const Node& node) const {
  return pieces_[*std::max_element(
      node.pieces.begin(), node.pieces.end(),
      [&](std::uint32_t a, std::uint32_t c) { return pieces_[a].integral.mass < pieces_[c].integral.mass; })];
}

template <class Curve>
void QuadWalk<Curve>::push_pieces(const QuadMass& quad, const BaseQuad& base, Node& node) {
  const Chart& chart = mass_.chart_of(quad);
  const std::span<const PieceMass> pieces = mass_.pieces_of(quad);
  piece_count_ = 0;
  roots_.clear();
  for (std::uint32_t i = 0; i < base.face_count; ++i) {
    if (!(pieces[i].mass > 0)) continue;
    roots_.push_back(static_cast<std::uint32_t>(piece_count_));
    MeasuredPiece& measured = push();
    measured.frame = i;
    measured.piece = whole_piece<kDimensions>(chart, mass_.mesh(), chart.face_of(base, i));
    clip_to_box<kDimensions>(measured.piece, node.low, node.size);
    measured.integral = pieces[i].integral(measured.piece.area_b() * frame(i).space);
  }
  node.pieces = roots_;
}

/// The standard deviation of the tone on the square, times its area, bounds the mass that an even spread
/// would misplace (E|t - mean| <= sigma).
template <class Curve>
bool QuadWalk<Curve>::is_even(const Node& node) const {
  double squares = 0, mass = 0;
  for (const auto index : node.pieces) {
    const MeasuredPiece& measured = pieces_[index];
    squares += frame(measured.frame).density * measured.integral.square;
    mass += measured.integral.mass;
  }
  return squares * node.size * node.size - mass * mass <= rule_.small_mass() * rule_.small_mass();
}

template <class Curve>
void QuadWalk<Curve>::cut_into_children(const Node& node, std::vector<std::vector<std::uint32_t>>& children) {
  for (auto& child : children) child.clear();
  for (const auto piece : node.pieces) distribute(node, piece, 0, 0, 1, children);
}

template <class Curve>
void QuadWalk<Curve>::distribute(const Node& node, std::uint32_t piece, int axis, unsigned slot,
                                 unsigned stride, std::vector<std::vector<std::uint32_t>>& children) {
  if (!(pieces_[piece].integral.mass > 0)) return;
  if (axis == kDimensions) return children[slot].push_back(piece);
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const auto& corner : pieces_[piece].piece.all()) {
    low = std::min(low, corner.place[axis]);
    high = std::max(high, corner.place[axis]);
  }
  unsigned part = 0;
  for (; part + 1 < Curve::kSide; ++part) {
    const double at = node.low[axis] + node.size * (part + 1) / Curve::kSide;
    if (high <= at) break;
    if (low >= at) continue;
    halve(piece, axis, at);
    const auto upper = static_cast<std::uint32_t>(piece_count_ - 1);
    distribute(node, upper - 1, axis + 1, slot + part * stride, stride * Curve::kSide, children);
    piece = upper;
  }
  distribute(node, piece, axis + 1, slot + part * stride, stride * Curve::kSide, children);
}

template <class Curve>
typename QuadWalk<Curve>::MeasuredPiece& QuadWalk<Curve>::push() {
  if (piece_count_ == pieces_.size()) pieces_.resize(2 * piece_count_ + 64);
  return pieces_[piece_count_++];
}

/// Puts the lower and the upper part of a piece on the stack. The smaller one is integrated, the larger one
/// gets the rest.
template <class Curve>
void QuadWalk<Curve>::halve(std::uint32_t index, int axis, double at) {
  push();
  MeasuredPiece& upper = push();
  MeasuredPiece& lower = pieces_[piece_count_ - 2];
  const MeasuredPiece& whole = pieces_[index];
  lower.frame = upper.frame = whole.frame;
  cut_piece(whole.piece, axis, at, lower.piece, upper.piece);
  const bool is_lower_smaller = lower.piece.area_b() < upper.piece.area_b();
  MeasuredPiece& smaller = is_lower_smaller ? lower : upper;
  MeasuredPiece& larger = is_lower_smaller ? upper : lower;
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
