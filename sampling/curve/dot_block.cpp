#include "sampling/curve/dot_block.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sampling/base/check.h"
#include "sampling/curve/chart.h"
#include "sampling/curve/project_to_surface.h"
#include "sampling/curve/stratum.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// How far outside of a face rounding may put a point that is in it, as a share of the face.
constexpr double kOnSide = 1e-12;
/// Where a sequence hits blank surface within a patch, up to this many positions in the patch are tried.
constexpr int kMaxTries = 8;

/// A point of the square, on one of the faces of a base quad.
struct Lifted {
  std::uint32_t frame = 0;
  Vector2d b = Vector2d::Zero();
  bool is_inside = false;
};

/// `likely` is the frame to try first, and becomes the one that was found: neighbors on the curve lie on few
/// faces.
template <class Walk>
inline Lifted lift(const Walk& walk, const Vector2d& place, std::uint32_t& likely) {
  const std::uint32_t count = walk.frame_count();
  std::uint32_t best = likely < count ? likely : 0;
  const auto look_into = [&](std::uint32_t i) {
    const FaceFrame& frame = walk.frame(i);
    const Vector2d along = frame.to_face * (place - frame.place);
    return std::pair(std::min(std::min(along.x(), along.y()), 1 - along.x() - along.y()), along);
  };
  auto [deepest, best_along] = look_into(best);
  if (!(deepest >= 0)) {
    // All faces, without a branch: which one it is cannot be predicted.
    for (std::uint32_t i = 0; i < count; ++i) {
      const auto [depth, along] = look_into(i);
      const bool is_deeper = depth > deepest;
      best = is_deeper ? i : best;
      deepest = is_deeper ? depth : deepest;
    }
    best_along = look_into(best).second;
  }
  likely = best;
  if (deepest < 0) {
    best_along = best_along.cwiseMax(0.);
    if (best_along.sum() > 1) best_along /= best_along.sum();
  }
  const FaceFrame& frame = walk.frame(best);
  return {best, frame.b + frame.face_to_b * best_along, deepest >= -kOnSide};
}

/// Steps of the curve's table that are fine enough for a patch with this many dots.
int curve_steps(double dots) {
  return dots < .5 ? 1 : dots < 30 ? 2 : dots < 2000 ? 3 : dots < 1e5 ? 4 : kMaxCurveSteps;
}

/// Mean positions of stretches of a curve. Most begin where the one before ended, so that moment is kept.
class CurveStretches {
 public:
  template <class Curve>
  Vector2d mean_place(Curve curve, double from, double to, int steps) {
    const Key key{Curve::kSide, curve.permutation, steps};
    if (!(from == last_ && key == key_)) moment_ = curve_moment(curve, from, steps);
    const Vector2d before = moment_;
    moment_ = curve_moment(curve, to, steps);
    last_ = to;
    key_ = key;
    return (moment_ - before) / (to - from);
  }

 private:
  struct Key {
    unsigned side = 0;  ///< of Curve: which one it is
    std::uint8_t permutation = 0;
    int steps = 0;
    bool operator==(const Key&) const = default;
  };

  Key key_;
  double last_ = -1;
  Vector2d moment_ = Vector2d::Zero();  ///< up to last_
};

/// What both writers share.
class DotWriter {
 public:
  DotWriter(const DotPlan& plan, DotTriangles& triangles, std::vector<Dot>& dots)
      : plan_(plan), triangles_(triangles), dots_(dots) {}

 protected:
  /// `asked`: the tone there, if it is known.
  void put_at(const SurfacePoint& point, std::uint32_t chart, std::optional<double> asked = {}) {
    const std::uint32_t component = plan_.mass.curve().charts()[chart].component;
    dots_.push_back(triangles_[point.triangle].dot_at(point.barycentric, component, asked));
  }

  const DotPlan& plan_;
  DotTriangles& triangles_;
  std::uint32_t likely_frame_ = 0;  ///< to lift() from

 private:
  std::vector<Dot>& dots_;
};

/// Puts one dot at the center of each stratum.
class CenterWriter : public DotWriter {
 public:
  using DotWriter::DotWriter;

  /// Whole base quads, `first` to `last` - 1.
  void add_quads(std::size_t first, std::size_t last) {
    const CurveMass& mass = plan_.mass;
    for (std::size_t begin = first; begin < last;) {
      const std::uint32_t chart = mass.quads()[begin].chart;
      StratumPart& part = stratum_.on(chart);
      double sum = 0, heaviest = 0;
      std::size_t heaviest_quad = begin, q = begin;
      for (; q < last && mass.quads()[q].chart == chart; ++q) {
        const double quad_mass = mass.mass_of(q);
        sum += quad_mass;
        part.moment_O += mass.quads()[q].moment_O;
        if (quad_mass > heaviest) {
          heaviest = quad_mass;
          heaviest_quad = q;
        }
      }
      if (sum > 0) {
        last_quad_ = heaviest_quad;
        part.mass += sum;
        part.triangle = kNoTriangle;
        if (heaviest > part.heaviest_mass) {
          part.heaviest_mass = heaviest;
          part.heaviest_quad = heaviest_quad;
          part.first_quad = begin;
          part.last_quad = q;
        }
      }
      begin = q;
    }
  }

  /// Shares of a light base quad's mass.
  void add_quad(std::size_t quad, double from, double to) {
    const double mass = (to - from) * plan_.mass.mass_of(quad);
    last_quad_ = quad;
    StratumPart& part = stratum_.on(plan_.mass.quads()[quad].chart);
    part.mass += mass;
    part.moment_O += (to - from) * plan_.mass.quads()[quad].moment_O;
    part.triangle = kNoTriangle;
    if (mass <= part.heaviest_mass) return;
    part.heaviest_mass = mass;
    part.heaviest_quad = part.first_quad = quad;
    part.last_quad = quad + 1;
  }

  template <class Curve>
  void add(const QuadWalk<Curve>& walk, const typename QuadWalk<Curve>::Node& node, PatchKind kind,
           double from, double to) {
    if (!(to > from)) return;
    last_quad_ = walk.quad();
    if constexpr (QuadWalk<Curve>::kDimensions == 2)
      if (kind == PatchKind::kEven) return add_even(walk, node, from, to);
    add_pieces(walk, node, from, to);
  }

  /// Strata that lie entirely in one patch: in an even one each needs only its middle.
  template <class Curve>
  void add_strata(const QuadWalk<Curve>& walk, const typename QuadWalk<Curve>::Node& node, PatchKind kind,
                  std::span<const double> ends, std::uint64_t index) {
    if constexpr (QuadWalk<Curve>::kDimensions == 2)
      if (kind == PatchKind::kEven) return add_even_strata(walk, node, ends, index);
    const auto add_stretch = [&](double from, double to) { add(walk, node, kind, from, to); };
    add_one_by_one(*this, add_stretch, ends, index);
  }

  void close(std::uint64_t) {
    // Rounding may leave a stratum at the very end of the curve without mass.
    if (stratum_.is_empty()) add_quads(last_quad_, last_quad_ + 1);
    const StratumPart& part = stratum_.heaviest();
    const PaintedPoint center = center_on_surface(plan_.mass, triangles_, part);
    put_at(center.point, part.chart, center.asked);
    stratum_.clear();
  }

 private:
  /// Each step for all strata before the next step, so that the processor need not wait for one result after
  /// another.
  template <class Curve>
  void add_even_strata(const QuadWalk<Curve>& walk, const typename QuadWalk<Curve>::Node& node,
                       std::span<const double> ends, std::uint64_t index) {
    last_quad_ = walk.quad();
    const int steps = curve_steps(node.mass / plan_.rule.dot_mass);
    moments_.clear();
    for (const double end : ends) moments_.push_back(curve_moment(node.curve, end, steps));
    for (std::size_t i = 1; i < ends.size(); ++i, ++index) {
      const Vector2d middle = (moments_[i] - moments_[i - 1]) / (ends[i] - ends[i - 1]);
      const Lifted lifted = lift(walk, node.low + node.size * middle, likely_frame_);
      const SurfacePoint point = point_in_triangle(walk.frame(lifted.frame).triangle, lifted.b);
      const double asked = triangles_[point.triangle].asked(point.barycentric);
      if (is_surely_painted(asked)) {
        put_at(point, walk.chart(), asked);
      } else {
        add_even(walk, node, ends[i - 1], ends[i]);
        close(index);
      }
    }
  }

  /// The mean position of a stretch of an even patch, on the square.
  template <class Node>
  Vector2d mean_place(const Node& node, double from, double to) {
    const int steps = curve_steps(node.mass / plan_.rule.dot_mass);
    return node.low + node.size * stretches_.mean_place(node.curve, from, to, steps);
  }

  StratumPart& begin_part(std::uint32_t chart) {
    StratumPart& part = stratum_.on(chart);
    is_new_ = !(part.mass > 0);
    return part;
  }

  /// Records in which triangle a part of the stratum lies.
  void add_in_triangle(StratumPart& part, std::uint32_t triangle, const Vector2d& moment_b) const {
    if (is_new_) part.triangle = triangle;
    if (part.triangle != triangle)
      part.triangle = kNoTriangle;
    else
      part.moment_b += moment_b;
  }

  template <class Curve>
  void add_even(const QuadWalk<Curve>& walk, const typename QuadWalk<Curve>::Node& node, double from,
                double to) {
    const double mass = (to - from) * node.mass;
    const Lifted lifted = lift(walk, mean_place(node, from, to), likely_frame_);
    const FaceFrame& frame = walk.frame(lifted.frame);
    StratumPart& part = begin_part(walk.chart());
    part.moment_O += mass * frame.at(lifted.b);
    add_in_triangle(part, frame.triangle, mass * lifted.b);
    part.mass += mass;
    if (mass <= part.heaviest_mass) return;
    part.heaviest_mass = mass;
    part.heaviest = point_in_triangle(frame.triangle, lifted.b);
    part.polygon_size = 0;
    part.heaviest_quad = StratumPart::kNoQuad;
  }

  template <class Curve>
  void add_pieces(const QuadWalk<Curve>& walk, const typename QuadWalk<Curve>::Node& node, double from,
                  double to) {
    const double share = to - from;
    StratumPart& part = begin_part(walk.chart());
    const auto& heaviest = walk.heaviest(node);
    for (const auto index : node.pieces) {
      const auto& measured = walk.piece(index);
      const FaceFrame& frame = walk.frame(measured.frame);
      const double scale = share * node.scale, mass = scale * measured.integral.mass;
      const Vector2d moment_b = scale * measured.integral.first;
      part.moment_O += mass * frame.origin_O + moment_b.x() * frame.e1_O + moment_b.y() * frame.e2_O;
      add_in_triangle(part, frame.triangle, moment_b);
      is_new_ = false;
    }
    if constexpr (QuadWalk<Curve>::kDimensions == 2)
      if (share < 1) shift_stretch(part, walk, node, from, to);
    part.mass += share * node.mass;
    const double mass = share * node.scale * heaviest.integral.mass;
    if (mass <= part.heaviest_mass) return;
    part.heaviest_mass = mass;
    part.heaviest = point_in_triangle(walk.frame(heaviest.frame).triangle,
                                      heaviest.integral.first / heaviest.integral.mass);
    part.polygon_size = heaviest.piece.corner_count;
    for (std::size_t i = 0; i < part.polygon_size; ++i) part.polygon[i] = heaviest.piece.corners[i].b;
    part.heaviest_quad = StratumPart::kNoQuad;
  }

  /// Moves the moment of a small patch, taken at the patch's middle, to where the curve runs on this stretch.
  template <class Curve>
  void shift_stretch(StratumPart& part, const QuadWalk<Curve>& walk,
                     const typename QuadWalk<Curve>::Node& node, double from, double to) {
    const Lifted middle = lift(walk, node.low + Vector2d::Constant(.5 * node.size), likely_frame_);
    const Vector2d place = node.low + node.size * stretches_.mean_place(node.curve, from, to, 1);
    const Lifted there = lift(walk, place, likely_frame_);
    const FaceFrame &at_middle = walk.frame(middle.frame), &at_there = walk.frame(there.frame);
    const double mass = (to - from) * node.mass;
    part.moment_O += mass * (at_there.at(there.b) - at_middle.at(middle.b));
    if (at_middle.triangle == part.triangle && at_there.triangle == part.triangle)
      part.moment_b += mass * (there.b - middle.b);
    else
      part.triangle = kNoTriangle;
  }

  Stratum stratum_;
  CurveStretches stretches_;
  std::vector<Vector2d> moments_;  ///< of add_even_strata
  bool is_new_ = true;             ///< nothing was added to the part before this patch
  std::size_t last_quad_ = 0;
};

/// Puts a dot where a number of the sequence falls.
class PlaceWriter : public DotWriter {
 public:
  using DotWriter::DotWriter;

  template <class Curve>
  void put(const QuadWalk<Curve>& walk, const typename QuadWalk<Curve>::Node& node, PatchKind, double share,
           std::uint64_t) {
    put_at(point_in(walk, node, share), walk.chart());
  }
  /// At the end of the curve, when rounding has put the number beyond its last quad.
  void put_in_quad(std::size_t quad) {
    put_at(heaviest_point(plan_.mass, quad), plan_.mass.quads()[quad].chart);
  }

 private:
  /// Within a patch the mass is taken as evenly spread over its painted surface: where the curve is on blank
  /// surface, or beside the surface, other positions in the patch are tried.
  template <class Curve>
  SurfacePoint point_in(const QuadWalk<Curve>& walk, const typename QuadWalk<Curve>::Node& node,
                        double share) {
    if constexpr (QuadWalk<Curve>::kDimensions == 2) {
      const double dots = std::max(1., node.mass / plan_.rule.dot_mass);
      for (int i = 0; i < kMaxTries; ++i) {
        const double at = share + std::fmod(i * std::numbers::phi, 1.) / dots;
        const Vector2d place = node.low + node.size * curve_place(node.curve, at - std::floor(at));
        const Lifted lifted = lift(walk, place, likely_frame_);
        const SurfacePoint point = point_in_triangle(walk.frame(lifted.frame).triangle, lifted.b);
        if (lifted.is_inside && triangles_[point.triangle].asked(point.barycentric) > 0) return point;
      }
    }
    if (node.pieces.empty()) return heaviest_point(plan_.mass, walk.quad());
    const auto& heaviest = walk.heaviest(node);
    const std::uint32_t triangle = walk.frame(heaviest.frame).triangle;
    const SurfacePoint center = point_in_triangle(triangle, heaviest.integral.first / heaviest.integral.mass);
    if (triangles_[triangle].asked(center.barycentric) > 0) return center;
    std::vector<Vector2d> polygon;
    for (const auto& corner : heaviest.piece.all()) polygon.push_back(corner.b);
    return point_with_tone(plan_.mass.tone(), triangle, polygon);
  }
};

}  // namespace

DotPlan::DotPlan(const CurveMass& m, const SampleOptions& options, std::uint64_t count)
    : mass(m),
      strata{m.total_m2(), count},
      rule{m.total_m2() / static_cast<double>(count), options.omega, options.uniform_depth.value_or(-1)} {
  if (options.sampler != Sampler::kCentroid && options.sampler != Sampler::kFine)
    sequence.emplace(options.sampler, count, options.seed);
}

BlockMaker::BlockMaker(const DotPlan& plan)
    : plan_(plan), walks_(plan), triangles_(plan.mass.curve().surface(), plan.mass.tone()) {}

void BlockMaker::make(std::uint64_t first, std::uint64_t last, DotBlock& block) {
  block.dots.clear();
  block.dots.reserve(last - first);
  block.patches_at_depth.clear();
  if (plan_.sequence) {
    PlaceWriter writer(plan_, triangles_, block.dots);
    find_places(plan_, walks_, first, last, writer, block.patches_at_depth);
  } else {
    CenterWriter writer(plan_, triangles_, block.dots);
    cut_strata(plan_, walks_, first, last, writer, block.patches_at_depth);
  }
  CHECK_EQ(block.dots.size(), last - first);
}

}  // namespace hilbrush
