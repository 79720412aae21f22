#pragma once
#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "sampling/curve/curve_mass.h"
#include "sampling/curve/curve_moment.h"
#include "sampling/curve/face_frame.h"

/// The walk along the curve below the base tree: from a base quad to its patches, in order, made anew each time and
/// never stored. After the thesis, section 4.2 and equations 7.3, 7.4; differs: the deviation is exact and decides on
/// the mass that may be misplaced, and a quad in which nothing is asked for (no dot, no end of a stratum) is not
/// divided.
namespace hilbrush {

/// When a quad is fine enough to be a patch.
struct PatchRule {
  double dot_mass = 1;     ///< m^2 of asked coverage that one dot stands for
  double omega = 4;        ///< 1/omega of a dot may be misplaced
  int uniform_depth = -1;  ///< if not negative: all patches at this depth, whatever they hold

  double small_mass() const { return dot_mass / omega; }
};

enum class PatchKind : std::uint8_t {
  kWhole,  ///< nothing is asked for inside: to be taken as it is
  kEven,   ///< its mass lies evenly on the square
  kSmall   ///< too little mass to be divided
};

/// Integrals over a piece; nothing if it is empty.
template <int kDimensions>
ToneIntegral integrate(const TriangleTone& tone, const Piece<kDimensions>& piece) {
  if (piece.corner_count < 3) return {};
  std::array<Eigen::Vector2d, Piece<kDimensions>::kMaxCorners> polygon;
  for (std::uint32_t i = 0; i < piece.corner_count; ++i) polygon[i] = piece.corners[i].b;
  return tone.integrate({polygon.data(), piece.corner_count});
}

/// Walks base quads of one kind of curve. `Sink` says what is asked for and takes the patches:
///   bool wants(double begin, double end)          something is asked for on this stretch of the curve's mass
///   void take(QuadWalk&, const Node&, PatchKind)  a patch, in order
/// Scratch memory is kept from quad to quad.
template <class Curve>
class QuadWalk {
 public:
  static constexpr int kDimensions = kDimensionsOf<Curve>;
  using Place = Eigen::Matrix<double, kDimensions, 1>;

  struct Node {
    Place low;
    double size = 1;
    Curve curve;
    int depth = 0;
    double at = 0, mass = 0;  ///< where on the curve it begins, and its mass
    double scale = 1;         ///< of its pieces' integrals, so that they sum to `mass`
    std::span<const std::uint32_t> pieces;
  };
  /// What a node holds of one triangle.
  struct Held {
    Piece<kDimensions> piece;
    std::uint32_t frame = 0;
    ToneIntegral integral;
  };

  QuadWalk(const CurveMass& mass, const PatchRule& rule) : mass_(mass), rule_(rule), store_(mass.tone()) {}

  template <class Sink>
  void walk(std::size_t quad_index, Sink& sink) {
    const QuadMass& quad = mass_.quads()[quad_index];
    const BaseQuad& base = mass_.base_quad(quad);
    chart_index_ = quad.chart;
    quad_index_ = quad_index;
    Node node;
    node.low = base.low.template head<kDimensions>();
    node.size = base.size;
    node.curve = curve_of<Curve>(base);
    node.depth = base.depth;
    node.at = mass_.mass_before(quad_index);
    node.mass = mass_.mass_of(quad_index);
    if (!(node.mass > 0)) return;
    store_.fetch(mass_.chart_of(quad), base, frames_);
    if (rule_.uniform_depth < 0 && node.mass > rule_.small_mass() && quad.misplaced <= rule_.small_mass())
      return sink.take(*this, node, PatchKind::kEven);
    push_pieces(quad, base, node);
    divide(node, sink);
  }

  /// Goes on with pieces that the square has shrunk to nothing.
  template <class Sink>
  void walk_pieces(std::uint32_t chart, std::size_t quad_index, const std::vector<FaceFrame*>& frames,
                   std::vector<Held> held, Node node, Sink& sink) {
    chart_index_ = chart;
    quad_index_ = quad_index;
    frames_ = frames;
    held_ = std::move(held);
    held_count_ = held_.size();
    roots_.clear();
    for (std::uint32_t i = 0; i < held_count_; ++i) roots_.push_back(i);
    node.pieces = roots_;
    divide(node, sink);
  }

  std::uint32_t chart() const { return chart_index_; }
  std::size_t quad() const { return quad_index_; }
  /// Of the base quad's faces.
  std::uint32_t frame_count() const { return static_cast<std::uint32_t>(frames_.size()); }
  const FaceFrame& frame(std::uint32_t i) const { return *frames_[i]; }
  const Held& held(std::uint32_t piece) const { return held_[piece]; }
  const PatchRule& rule() const { return rule_; }
  /// The heaviest of a node's pieces, which has some unless it is an even base quad.
  const Held& heaviest(const Node& node) const;

 private:
  /// Quads get no smaller than this, relative to the square; what is still too much for one patch goes on in space.
  static constexpr double kMin = 0x1p-46;
  static constexpr int kMaxLevels = 64;
  /// What rounding leaves of a mass when all of it is taken away.
  static constexpr double kRoundingShare = 1e-12;

  void push_pieces(const QuadMass& quad, const BaseQuad& base, Node& node);
  bool is_even(const Node& node) const;
  void cut_into_children(const Node& node, std::vector<std::vector<std::uint32_t>>& children);
  void distribute(const Node& node, std::uint32_t piece, int axis, unsigned place, unsigned stride,
                  std::vector<std::vector<std::uint32_t>>& children);
  void halve(std::uint32_t index, int axis, double at);
  /// The next piece on the stack, which may move all pieces.
  Held& push();

  template <class Sink>
  void divide(const Node& node, Sink& sink, int level = 0) {
    if (!(node.mass > 0) || node.pieces.empty()) return;
    if (rule_.uniform_depth >= 0) {
      if (node.depth >= rule_.uniform_depth) return sink.take(*this, node, PatchKind::kSmall);
    } else {
      if (!sink.wants(node.at, node.at + node.mass)) return sink.take(*this, node, PatchKind::kWhole);
      if (node.mass <= rule_.small_mass()) return sink.take(*this, node, PatchKind::kSmall);
      if (kDimensions == 2 && is_even(node)) return sink.take(*this, node, PatchKind::kEven);
    }
    if (level == kMaxLevels) return sink.take(*this, node, PatchKind::kSmall);
    if constexpr (kDimensions == 2)
      if (node.size < kMin) return divide_in_space(node, sink);
    if (levels_.size() <= static_cast<std::size_t>(level)) levels_.emplace_back(new Level{});
    auto& children = levels_[static_cast<std::size_t>(level)]->children;
    const std::size_t held_before = held_count_;
    cut_into_children(node, children);
    std::array<double, Curve::kChildCount> masses{};
    double sum = 0;
    for (unsigned place = 0; place < Curve::kChildCount; ++place) {
      for (const auto piece : children[place]) masses[place] += held_[piece].integral.mass;
      sum += masses[place];
    }
    if (!(sum > 0)) {
      held_count_ = held_before;
      return sink.take(*this, node, PatchKind::kSmall);
    }
    Node child;
    child.size = node.size / Curve::kSide;
    child.depth = node.depth + 1;
    child.scale = node.mass / sum;
    child.at = node.at;
    for (unsigned i = 0; i < Curve::kChildCount; ++i) {
      unsigned place = node.curve.place(i);
      child.mass = masses[place] * child.scale;
      child.pieces = children[place];
      child.curve = node.curve.child(i);
      child.low = node.low;
      for (int k = 0; k < kDimensions; ++k, place /= Curve::kSide) child.low[k] += child.size * (place % Curve::kSide);
      divide(child, sink, level + 1);
      child.at += child.mass;
    }
    held_count_ = held_before;
  }

  template <class Sink>
  void divide_in_space(const Node& node, Sink& sink);

  struct Level {
    std::vector<std::vector<std::uint32_t>> children{Curve::kChildCount};
  };

  const CurveMass& mass_;
  PatchRule rule_;
  std::uint32_t chart_index_ = 0;
  std::size_t quad_index_ = 0;
  FaceFrames store_;
  std::vector<FaceFrame*> frames_;
  std::vector<Held> held_;  ///< a stack; never shorter than it was, so that it is not cleared again and again
  std::size_t held_count_ = 0;
  std::vector<std::uint32_t> roots_;
  std::vector<std::unique_ptr<Level>> levels_;
  std::unique_ptr<QuadWalk<HilbertCube>> in_space_;
};

template <class Curve>
template <class Sink>
void QuadWalk<Curve>::divide_in_space(const Node& node, Sink& sink) {
  if (!in_space_) in_space_ = std::make_unique<QuadWalk<HilbertCube>>(mass_, rule_);
  std::vector<QuadWalk<HilbertCube>::Held> held;
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (const auto index : node.pieces) {
    const Held& mine = held_[index];
    QuadWalk<HilbertCube>::Held there;
    there.frame = mine.frame;
    there.integral = mine.integral;
    for (const auto& corner : mine.piece.all()) {
      const Eigen::Vector3d p = frame(mine.frame).at(corner.b);
      there.piece.add({p, corner.b});
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    held.push_back(there);
  }
  QuadWalk<HilbertCube>::Node there;
  there.size = (high - low).maxCoeff() * (1 + 1e-9);
  there.low = .5 * (low + high) - Eigen::Vector3d::Constant(there.size / 2);
  there.depth = node.depth;
  there.at = node.at;
  there.mass = node.mass;
  there.scale = node.scale;
  in_space_->walk_pieces(chart_index_, quad_index_, frames_, std::move(held), there, sink);
}

extern template class QuadWalk<HilbertQuad>;
extern template class QuadWalk<PeanoQuad>;
extern template class QuadWalk<HilbertCube>;

}  // namespace hilbrush
