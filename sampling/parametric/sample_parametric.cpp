#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "sampling/base/check.h"
#include "sampling/base/input_error.h"
#include "sampling/curve/curve_moment.h"
#include "sampling/curve/sequence.h"
#include "sampling/parametric/leaf_area.h"
#include "sampling/parametric/parametric.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d;

constexpr std::uint64_t kMaxDots = 100'000'000;

/// Depths of a curve: that of the nodes on which threads work, the defaults of minimum and maximum, and the
/// largest one that a setting may ask for, at which the number of leaves is still exact in a double.
template <class Quad>
struct Depths;
template <>
struct Depths<HilbertQuad> {
  static constexpr int kNodes = 5;
  static constexpr int kDefaultMin = 5;
  static constexpr int kDefaultMax = 13;
  static constexpr int kLimit = 26;
};
template <>
struct Depths<PeanoQuad> {
  static constexpr int kNodes = 3;
  static constexpr int kDefaultMin = 3;
  static constexpr int kDefaultMax = 8;
  static constexpr int kLimit = 16;
};

template <class Quad>
DivisionRule rule_of(const ParametricOptions& options, const DensityOnSurface& density) {
  const auto checked = [](int depth, const char* name) {
    if (depth < 0 || depth > Depths<Quad>::kLimit)
      throw InputError(name, "is not a depth from 0 to " + std::to_string(Depths<Quad>::kLimit));
    return depth;
  };
  DivisionRule rule;
  rule.minimum_depth = checked(options.minimum_depth.value_or(Depths<Quad>::kDefaultMin), "minimum_depth");
  rule.maximum_depth = checked(options.maximum_depth.value_or(Depths<Quad>::kDefaultMax), "maximum_depth");
  if (!options.minimum_depth) rule.minimum_depth = std::min(rule.minimum_depth, rule.maximum_depth);
  if (!options.maximum_depth) rule.maximum_depth = std::max(rule.minimum_depth, rule.maximum_depth);
  if (rule.minimum_depth > rule.maximum_depth) throw InputError("minimum_depth", "is above maximum_depth");
  if (!(options.omega > 0)) throw InputError("omega", "must be above 0");
  const double vertices = options.omega * static_cast<double>(std::max<std::uint64_t>(1, options.dot_count));
  rule.largest_reach = .5 * std::sqrt(density.area() / vertices);
  return rule;
}

/// The curve on one surface for one set of options, divided into nodes.
template <class Quad>
class Sampling {
 public:
  Sampling(const ParametricSurface& surface, const ParametricOptions& options)
      : surface_(surface),
        options_(options),
        density_(surface, options.density),
        rule_(rule_of<Quad>(options, density_)),
        curve_(surface, density_, rule_),
        nodes_(curve_.nodes_at(std::min(Depths<Quad>::kNodes, rule_.minimum_depth))) {}

  ParametricSamples sample() {
    ParametricSamples samples;
    measure(samples);
    if (options_.dot_count == 0) return samples;
    if (!(total() > 0)) throw InputError("density", "is zero everywhere on the surface");
    samples.dots.resize(options_.dot_count);
    if (options_.sampler == Sampler::kCentroid)
      place_centroids(samples.dots);
    else
      place_sequence(samples.dots);
    tbb::parallel_for(std::size_t{0}, samples.dots.size(), [&](std::size_t i) {
      ParametricDot& dot = samples.dots[i];
      dot.position = surface_.position(dot.uv);
      dot.normal = surface_.normal(dot.uv);
    });
    return samples;
  }

  ParametricAreas areas() {
    ParametricAreas areas;
    for (const AreaMethod method :
         {AreaMethod::kTriangle, AreaMethod::kSquare, AreaMethod::kFirstFundamentalForm}) {
      options_.area = method;
      ParametricSamples measured;
      measure(measured);
      areas.by_method[static_cast<std::size_t>(method)] = measured.area;
      areas.vertex_count = measured.vertex_count;
    }
    return areas;
  }

  std::vector<Vector2d> vertices() {
    std::vector<Vector2d> all;
    for (NodeOf node : nodes_)
      curve_.walk(node, [&](const NodeOf& leaf) { all.push_back(leaf.center_uv()); });
    return all;
  }

 private:
  using NodeOf = Node<Quad>;

  double total() const { return mass_before_.back(); }

  double mass_of(const VertexArea& vertex) const {
    return density_.is_constant() ? vertex.area : vertex.area * density_.at(vertex.density_uv);
  }

  template <class Visit>
  void walk(std::size_t node, Visit&& visit) const {
    AreaWalk<Quad>(surface_, curve_, nodes_, options_.area).walk(node, visit);
  }

  /// First walk: the mass before each node.
  void measure(ParametricSamples& samples) {
    struct Sum {
      double area = 0;
      double mass = 0;
      std::uint64_t leaves = 0;
      int deepest = 0;
    };
    std::vector<Sum> sums(nodes_.size());
    tbb::parallel_for(std::size_t{0}, nodes_.size(), [&](std::size_t n) {
      Sum sum;
      walk(n, [&](const NodeOf& leaf, const VertexArea& vertex) {
        sum.area += vertex.area;
        sum.mass += mass_of(vertex);
        ++sum.leaves;
        sum.deepest = std::max(sum.deepest, leaf.depth);
      });
      sums[n] = sum;
    });
    mass_before_.assign(1, 0);
    for (const Sum& sum : sums) {
      samples.area += sum.area;
      samples.vertex_count += sum.leaves;
      samples.deepest = std::max(samples.deepest, sum.deepest);
      mass_before_.push_back(mass_before_.back() + sum.mass);
    }
  }

  /// Second walk of a node: visits the leaves that have mass, with the mass before and after each.
  template <class Visit>
  void walk_masses(std::size_t node, Visit&& visit) const {
    double before = mass_before_[node];
    walk(node, [&](const NodeOf& leaf, const VertexArea& vertex) {
      const double after = before + mass_of(vertex);
      if (!(after > before)) return;
      visit(leaf, before, after);
      before = after;
    });
  }

  Vector2d place_in(const NodeOf& leaf, double share) const {
    if (options_.snaps_to_vertices) return leaf.center_uv();
    const Vector2d place = curve_place(leaf.quad, share);
    return leaf.uv(place.x(), place.y());
  }

  void place_sequence(std::vector<ParametricDot>& dots) const {
    const Sequence sequence(options_.sampler, options_.dot_count, options_.seed);
    // The first dot whose number is at or above a mass, by bisection: the numbers rise.
    const auto first_at = [&](double mass) {
      std::uint64_t low = 0, high = dots.size();
      while (low < high) {
        const std::uint64_t middle = (low + high) / 2;
        if (sequence.at(middle) * total() < mass)
          low = middle + 1;
        else
          high = middle;
      }
      return low;
    };
    tbb::parallel_for(std::size_t{0}, nodes_.size(), [&](std::size_t n) {
      std::uint64_t next = first_at(mass_before_[n]);
      const std::uint64_t end = n + 1 == nodes_.size() ? dots.size() : first_at(mass_before_[n + 1]);
      if (next == end) return;
      double threshold = sequence.at(next) * total();
      NodeOf last = nodes_[n];
      walk_masses(n, [&](const NodeOf& leaf, double before, double after) {
        last = leaf;
        while (next < end && threshold < after) {
          dots[next].uv = place_in(leaf, std::max(0., threshold - before) / (after - before));
          if (++next < end) threshold = sequence.at(next) * total();
        }
      });
      for (; next < end; ++next)
        dots[next].uv = place_in(last, 1);  // those that rounding put beyond the last leaf
    });
  }

  /// The share of a stratum in a node.
  struct StratumShare {
    std::uint64_t index = 0;
    double mass = 0;
    Vector2d moment_uv = Vector2d::Zero();
  };

  /// Strata of equal mass; a dot at each one's center of mass in the parameter domain.
  void place_centroids(std::vector<ParametricDot>& dots) const {
    std::vector<std::vector<StratumShare>> shares(nodes_.size());
    tbb::parallel_for(std::size_t{0}, nodes_.size(),
                      [&](std::size_t n) { shares[n] = cut_strata(n, dots.size()); });
    std::vector<double> masses(dots.size(), 0);
    for (auto& dot : dots) dot.uv.setZero();
    for (const auto& of_node : shares)
      for (const StratumShare& share : of_node) {
        dots[share.index].uv += share.moment_uv;
        masses[share.index] += share.mass;
      }
    for (std::size_t i = 0; i < dots.size(); ++i) {
      if (masses[i] > 0)
        dots[i].uv /= masses[i];
      else if (i > 0)  // a stratum lost in rounding
        dots[i].uv = dots[i - 1].uv;
    }
  }

  std::vector<StratumShare> cut_strata(std::size_t node, std::uint64_t count) const {
    const double stratum_mass = total() / static_cast<double>(count);
    const auto end_of = [&](std::uint64_t index) {
      return index + 1 == count ? 2 * total() : static_cast<double>(index + 1) * stratum_mass;
    };
    std::vector<StratumShare> shares;
    StratumShare current;
    current.index = std::min(count - 1, static_cast<std::uint64_t>(mass_before_[node] / stratum_mass));
    walk_masses(node, [&](const NodeOf& leaf, double before, double after) {
      double from = before;
      Vector2d moment_from = Vector2d::Zero();
      while (true) {
        const double to = std::clamp(end_of(current.index), from, after);
        const double share = (to - before) / (after - before);
        const Vector2d moment = to < after ? curve_moment(leaf.quad, share) : curve_moment(leaf.quad, 1.);
        current.mass += to - from;
        const double weight = (to - from) / (after - before);
        const Vector2d offset = weight * Vector2d(static_cast<double>(leaf.x), static_cast<double>(leaf.y));
        current.moment_uv += (after - before) * leaf.size() * (offset + moment - moment_from);
        if (to >= after && end_of(current.index) > after) break;
        shares.push_back(current);
        current = {current.index + 1, 0, Vector2d::Zero()};
        from = to;
        moment_from = moment;
      }
    });
    shares.push_back(current);
    return shares;
  }

  const ParametricSurface& surface_;
  ParametricOptions options_;
  DensityOnSurface density_;
  DivisionRule rule_;
  AdaptiveCurve<Quad> curve_;
  std::vector<NodeOf> nodes_;
  std::vector<double> mass_before_;
};

void check_options(const ParametricOptions& options) {
  if (options.sampler == Sampler::kBlue || options.sampler == Sampler::kFine)
    throw InputError("sampler", "blue and fine need a mesh");
  if (options.curve == CurveKind::kLaminar) throw InputError("curve", "laminar slices need a mesh");
  if (options.snaps_to_vertices && options.sampler == Sampler::kCentroid)
    throw InputError("snaps_to_vertices", "would undo centroid");
  if (options.dot_count > kMaxDots) throw InputError("dot_count", "is above " + std::to_string(kMaxDots));
}

/// Calls `use` with the sampling of the curve that was asked for.
template <class Use>
auto with_curve(const ParametricSurface& surface, const ParametricOptions& options, Use use) {
  check_options(options);
  if (options.curve == CurveKind::kPeano2) {
    Sampling<PeanoQuad> sampling(surface, options);
    return use(sampling);
  }
  Sampling<HilbertQuad> sampling(surface, options);
  return use(sampling);
}

}  // namespace

ParametricSamples sample_parametric(const ParametricSurface& surface, const ParametricOptions& options) {
  return with_curve(surface, options, [](auto& sampling) { return sampling.sample(); });
}

ParametricAreas measure_parametric(const ParametricSurface& surface, const ParametricOptions& options) {
  return with_curve(surface, options, [](auto& sampling) { return sampling.areas(); });
}

std::vector<Eigen::Vector2d> parametric_curve(const ParametricSurface& surface,
                                              const ParametricOptions& options) {
  return with_curve(surface, options, [](auto& sampling) { return sampling.vertices(); });
}

}  // namespace hilbrush
