#pragma once
#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "sampling/curve/curve_mass.h"
#include "sampling/curve/curve_moment.h"
#include "sampling/curve/face_frame.h"

/// The walk along the curve below the base tree: from a base quad to its patches, in order. They are made
/// again on each walk and never stored. After the thesis, section 4.2 and equations 7.3, 7.4; differs: the
/// deviation is exact and limits the mass that may be misplaced, and a quad in which nothing is needed (no
/// dot, no end of a stratum) is not divided.
namespace hilbrush {

/// When a quad is fine enough to be a patch.
struct PatchRule {
  double dot_mass = 1;     ///< m^2 of asked coverage that one dot stands for
  double omega = 4;        ///< 1/omega of a dot's mass may be misplaced
  int uniform_depth = -1;  ///< if not negative: all patches at this depth, whatever they hold

  double small_mass() const { return dot_mass / omega; }
};

enum class PatchKind : std::uint8_t {
  kWhole,  ///< nothing is needed inside: to be taken as it is
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

/// Walks base quads of one kind of curve. `Sink` says what it needs and takes the patches:
///   bool wants(double begin, double end)          something is needed on this stretch of the curve's mass
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
  /// What a node contains of one triangle, and its integral.
  struct MeasuredPiece {
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

  /// Goes on, in space, with pieces that the map has shrunk to nothing on the square.
  template <class Sink>
  void walk_pieces(std::uint32_t chart, std::size_t quad_index, const std::vector<FaceFrame*>& frames,
                   std::vector<MeasuredPiece> measured, Node node, Sink& sink) {
    chart_index_ = chart;
    quad_index_ = quad_index;
    frames_ = frames;
    pieces_ = std::move(measured);
    piece_count_ = pieces_.size();
    roots_.clear();
    for (std::uint32_t i = 0; i < piece_count_; ++i) roots_.push_back(i);
    node.pieces = roots_;
    divide(node, sink);
  }

  std::uint32_t chart() const { return chart_index_; }
  std::size_t quad() const { return quad_index_; }
  /// Frames of the base quad's faces.
  std::uint32_t frame_count() const { return static_cast<std::uint32_t>(frames_.size()); }
  const FaceFrame& frame(std::uint32_t i) const { return *frames_[i]; }
  const MeasuredPiece& piece(std::uint32_t index) const { return pieces_[index]; }
  const PatchRule& rule() const { return rule_; }
  /// The heaviest of a node's pieces. Only an even base quad has none.
  const MeasuredPiece& heaviest(const Node& node) const;

 private:
  /// Smallest side of a quad, in units of the square; what is still too much for one patch is divided in
  /// space.
  static constexpr double kMinSize = 0x1p-46;
  static constexpr int kMaxLevels = 64;
  /// A part with a smaller share of its whole's mass is taken for a rounding error of the subtraction.
  static constexpr double kRoundingShare = 1e-12;

  void push_pieces(const QuadMass& quad, const BaseQuad& base, Node& node);
  bool is_even(const Node& node) const;
  void cut_into_children(const Node& node, std::vector<std::vector<std::uint32_t>>& children);
  void distribute(const Node& node, std::uint32_t piece, int axis, unsigned slot, unsigned stride,
                  std::vector<std::vector<std::uint32_t>>& children);
  void halve(std::uint32_t index, int axis, double at);
  /// Adds a piece to the stack, which may move all pieces in memory.
  MeasuredPiece& push();

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
      if (node.size < kMinSize) return divide_in_space(node, sink);
    if (levels_.size() <= static_cast<std::size_t>(level)) levels_.emplace_back(new Level{});
    auto& children = levels_[static_cast<std::size_t>(level)]->children;
    const std::size_t count_before = piece_count_;
    cut_into_children(node, children);
    std::array<double, Curve::kChildCount> masses{};
    double sum = 0;
    for (unsigned slot = 0; slot < Curve::kChildCount; ++slot) {
      for (const auto index : children[slot]) masses[slot] += pieces_[index].integral.mass;
      sum += masses[slot];
    }
    if (!(sum > 0)) {
      piece_count_ = count_before;
      return sink.take(*this, node, PatchKind::kSmall);
    }
    Node child;
    child.size = node.size / Curve::kSide;
    child.depth = node.depth + 1;
    child.scale = node.mass / sum;
    child.at = node.at;
    for (unsigned i = 0; i < Curve::kChildCount; ++i) {
      unsigned slot = node.curve.slot(i);
      child.mass = masses[slot] * child.scale;
      child.pieces = children[slot];
      child.curve = node.curve.child(i);
      child.low = node.low;
      for (int k = 0; k < kDimensions; ++k, slot /= Curve::kSide)
        child.low[k] += child.size * (slot % Curve::kSide);
      divide(child, sink, level + 1);
      child.at += child.mass;
    }
    piece_count_ = count_before;
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
  std::vector<MeasuredPiece>
      pieces_;  ///< a stack; never shorter than it was, so that it is not cleared again and again
  std::size_t piece_count_ = 0;
  std::vector<std::uint32_t> roots_;
  std::vector<std::unique_ptr<Level>> levels_;
  std::unique_ptr<QuadWalk<HilbertCube>> in_space_;
};

template <class Curve>
template <class Sink>
void QuadWalk<Curve>::divide_in_space(const Node& node, Sink& sink) {
  if (!in_space_) in_space_ = std::make_unique<QuadWalk<HilbertCube>>(mass_, rule_);
  std::vector<QuadWalk<HilbertCube>::MeasuredPiece> measured;
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (const auto index : node.pieces) {
    const MeasuredPiece& here = pieces_[index];
    QuadWalk<HilbertCube>::MeasuredPiece there;
    there.frame = here.frame;
    there.integral = here.integral;
    for (const auto& corner : here.piece.all()) {
      const Eigen::Vector3d p = frame(here.frame).at(corner.b);
      there.piece.add({p, corner.b});
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    measured.push_back(there);
  }
  QuadWalk<HilbertCube>::Node there;
  there.size = (high - low).maxCoeff() * (1 + 1e-9);
  there.low = .5 * (low + high) - Eigen::Vector3d::Constant(there.size / 2);
  there.depth = node.depth;
  there.at = node.at;
  there.mass = node.mass;
  there.scale = node.scale;
  in_space_->walk_pieces(chart_index_, quad_index_, frames_, std::move(measured), there, sink);
}

extern template class QuadWalk<HilbertQuad>;
extern template class QuadWalk<PeanoQuad>;
extern template class QuadWalk<HilbertCube>;

}  // namespace hilbrush
