#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

#include "sampling/curve/quad_walk.h"
#include "sampling/curve/sequence.h"

/// Sinks of the walk: one cuts the curve's mass into strata, one finds points along it. Both work on a block
/// of dots and need nothing of what comes before or after it, so that blocks may be made in any order.
namespace hilbrush {

/// Equal stretches of the whole curve's mass, one for each dot.
struct Strata {
  double total = 0;
  std::uint64_t count = 0;

  double begin_of(std::uint64_t k) const {
    return k >= count ? total : total * (static_cast<double>(k) / static_cast<double>(count));
  }
};

/// How dots are to be placed: the same for all blocks.
struct DotPlan {
  DotPlan(const CurveMass& mass, const SampleOptions& options, std::uint64_t count);

  const CurveMass& mass;
  Strata strata;
  PatchRule rule;
  std::optional<Sequence> sequence;  ///< where along the curve; nothing: at the centers of strata
};

/// Whole strata one after another: add(from, to) for each, and its end.
template <class Consumer, class Add>
void add_one_by_one(Consumer& consumer, Add add, std::span<const double> ends, std::uint64_t index) {
  for (std::size_t i = 1; i < ends.size(); ++i) {
    add(ends[i - 1], ends[i]);
    consumer.close(index++);
  }
}

/// Cuts strata `first` to `last` - 1 out of patches, and calls of `consumer`:
///   void add(walk, node, kind, double from, double to)   the current stratum has this stretch of a patch, as
///   shares of
///                                                        its mass
///   void close(std::uint64_t index)                      it is complete
///   void add_strata(walk, node, kind, std::span<const double> ends, std::uint64_t index)
///                                                        instead, for strata that lie entirely in one patch,
///                                                        from `index` on, each between two ends
template <class Consumer>
class StrataCutter {
 public:
  StrataCutter(const Strata& strata, std::uint64_t first, std::uint64_t last, Consumer& consumer)
      : strata_(strata),
        consumer_(consumer),
        index_(first),
        last_(last),
        is_open_(first == 0),
        next_(strata.begin_of(is_open_ ? 1 : first)) {
    if (is_open_ && strata.count == 1) next_ = std::numeric_limits<double>::infinity();
  }

  bool is_done() const { return index_ == last_; }
  /// Something of a stratum begins or ends here.
  bool wants(double, double end) const { return next_ < end && !is_done(); }
  /// Lies before the first stratum.
  bool is_skipped() const { return !is_open_; }

  template <class Walk, class Node>
  void take(const Walk& walk, const Node& node, PatchKind kind) {
    cut(
        node.at, node.mass, [&](double from, double to) { consumer_.add(walk, node, kind, from, to); },
        [&](std::span<const double> ends, std::uint64_t index) {
          consumer_.add_strata(walk, node, kind, ends, index);
        });
  }
  /// A base quad too light to be looked into.
  void take_quad(std::size_t quad, double at, double mass) {
    const auto add = [&](double from, double to) { consumer_.add_quad(quad, from, to); };
    cut(at, mass, add, [&](std::span<const double> ends, std::uint64_t index) {
      add_one_by_one(consumer_, add, ends, index);
    });
  }

  /// At the end of the curve: closes the strata that rounding has left open.
  void finish() {
    while (!is_done()) pass();
  }

 private:
  /// This many whole strata are handed over at once.
  static constexpr std::size_t kStrataAtOnce = 32;

  template <class Add, class AddStrata>
  void cut(double at, double mass, Add add, AddStrata add_strata) {
    const auto is_next_here = [&] { return next_ < at + mass && !is_done(); };
    double share = 0;
    const auto share_of_next = [&] { return std::clamp((next_ - at) / mass, share, 1.); };
    if (is_next_here()) {
      const double next = share_of_next();
      if (is_open_ && next > share) add(share, next);
      share = next;
      pass();
    }
    // From here on each stratum begins where the one before ends.
    while (is_next_here()) {
      std::array<double, kStrataAtOnce + 1> ends{share};
      std::size_t count = 0;
      const std::uint64_t first = index_;
      while (count < kStrataAtOnce && is_next_here() && share_of_next() > share) {
        ends[++count] = share = share_of_next();
        ++index_;
        go_on();
      }
      if (count > 0)
        add_strata(std::span(ends).first(count + 1), first);
      else
        pass();  // rounding has left nothing to this one
    }
    if (is_open_ && !is_done() && share < 1) add(share, 1.);
  }

  void pass() {
    if (is_open_) consumer_.close(index_++);
    is_open_ = true;
    go_on();
  }

  void go_on() {
    next_ =
        index_ + 1 < strata_.count ? strata_.begin_of(index_ + 1) : std::numeric_limits<double>::infinity();
  }

  const Strata& strata_;
  Consumer& consumer_;
  std::uint64_t index_, last_;
  bool is_open_;  ///< the walk has reached the beginning of stratum index_
  double next_;   ///< where the current stratum ends, or the first one begins
};

/// Finds numbers `first` to `last` - 1 of a sequence along the curve, and calls of `consumer`:
///   void put(walk, node, kind, double share, std::uint64_t index)   where in a patch
template <class Consumer>
class PlaceFinder {
 public:
  PlaceFinder(const Sequence& sequence, double total, std::uint64_t first, std::uint64_t last,
              Consumer& consumer)
      : sequence_(sequence), total_(total), consumer_(consumer), index_(first), last_(last) {
    next_ = place_of(first);
  }

  bool is_done() const { return index_ == last_; }
  std::uint64_t index() const { return index_; }
  bool wants(double, double end) const { return next_ < end && !is_done(); }
  bool is_skipped() const { return false; }

  template <class Walk, class Node>
  void take(const Walk& walk, const Node& node, PatchKind kind) {
    while (wants(node.at, node.at + node.mass)) {
      consumer_.put(walk, node, kind, std::clamp((next_ - node.at) / node.mass, 0., 1.), index_);
      next_ = place_of(++index_);
    }
  }

 private:
  double place_of(std::uint64_t index) const { return index < last_ ? total_ * sequence_.at(index) : total_; }

  const Sequence& sequence_;
  double total_;
  Consumer& consumer_;
  std::uint64_t index_, last_;
  double next_;
};

/// Hands patches on to the cutter (or finder), and counts them.
template <class Cutter>
class CountingSink {
 public:
  CountingSink(Cutter& cutter, std::vector<std::size_t>& patches_at_depth)
      : cutter_(cutter), patches_at_depth_(patches_at_depth) {}

  bool wants(double begin, double end) const { return cutter_.wants(begin, end); }

  template <class Walk, class Node>
  void take(const Walk& walk, const Node& node, PatchKind kind) {
    cutter_.take(walk, node, kind);
    if (!cutter_.is_skipped() && !cutter_.is_done()) count(static_cast<std::size_t>(node.depth));
  }
  void count(std::size_t depth) {
    if (patches_at_depth_.size() <= depth) patches_at_depth_.resize(depth + 1);
    ++patches_at_depth_[depth];
  }

 private:
  Cutter& cutter_;
  std::vector<std::size_t>& patches_at_depth_;
};

/// One walk for each kind of curve, made at first use.
class Walks {
 public:
  explicit Walks(const DotPlan& plan) : plan_(plan) {}

  template <class Sink>
  void walk(std::size_t quad, Sink& sink) {
    with_curve(plan_.mass.chart_of(plan_.mass.quads()[quad]).kind, [&]<class Curve>(Curve) {
      auto& walk = std::get<std::optional<QuadWalk<Curve>>>(walks_);
      if (!walk) walk.emplace(plan_.mass, plan_.rule);
      walk->walk(quad, sink);
    });
  }

 private:
  const DotPlan& plan_;
  std::tuple<std::optional<QuadWalk<HilbertQuad>>, std::optional<QuadWalk<PeanoQuad>>,
             std::optional<QuadWalk<HilbertCube>>>
      walks_;
};

/// A base quad with at most this share of a small patch's mass is cut without walking it: where in it a
/// stratum ends makes no difference.
inline constexpr double kLightShare = .5;

/// Cuts strata `first` to `last` - 1, with the calls of StrataCutter to `consumer`, and for whole base quads
///   void add_quads(std::size_t first, std::size_t last)           `last` not included
///   void add_quad(std::size_t quad, double from, double to)   shares of its mass
template <class Consumer>
void cut_strata(const DotPlan& plan, Walks& walks, std::uint64_t first, std::uint64_t last,
                Consumer& consumer, std::vector<std::size_t>& patches_at_depth) {
  const CurveMass& mass = plan.mass;
  StrataCutter cutter(plan.strata, first, last, consumer);
  CountingSink sink(cutter, patches_at_depth);
  const std::size_t end = mass.quads().size();
  for (std::size_t q = mass.quad_at(plan.strata.begin_of(first)); q < end && !cutter.is_done();) {
    const auto is_walked = [&] {
      return plan.rule.uniform_depth >= 0 || sink.wants(mass.mass_before(q), mass.mass_before(q + 1));
    };
    const std::size_t run = q;
    while (q < end && !is_walked()) ++q;
    if (q > run && !cutter.is_skipped()) {
      consumer.add_quads(run, q);
      for (std::size_t i = run; i < q; ++i)
        if (mass.mass_of(i) > 0) sink.count(mass.quads()[i].depth);
    }
    if (q == end) break;
    const double quad_mass = mass.mass_of(q);
    if (plan.rule.uniform_depth < 0 && quad_mass <= kLightShare * plan.rule.small_mass()) {
      cutter.take_quad(q, mass.mass_before(q), quad_mass);
      sink.count(mass.quads()[q].depth);
    } else if (quad_mass > 0) {
      walks.walk(q, sink);
    }
    ++q;
  }
  cutter.finish();
}

/// Finds numbers `first` to `last` - 1 of the plan's sequence, with the calls of PlaceFinder to `consumer`,
/// and for those that rounding has put beyond the last quad
///   void put_in_quad(std::size_t quad)
template <class Consumer>
void find_places(const DotPlan& plan, Walks& walks, std::uint64_t first, std::uint64_t last,
                 Consumer& consumer, std::vector<std::size_t>& patches_at_depth) {
  const CurveMass& mass = plan.mass;
  PlaceFinder finder(*plan.sequence, mass.total_m2(), first, last, consumer);
  CountingSink sink(finder, patches_at_depth);
  std::size_t last_quad = 0;
  for (std::size_t q = mass.quad_at(mass.total_m2() * plan.sequence->at(first)); q < mass.quads().size();
       ++q) {
    if (finder.is_done()) return;
    if (!(mass.mass_of(q) > 0)) continue;
    last_quad = q;
    if (plan.rule.uniform_depth >= 0 || sink.wants(mass.mass_before(q), mass.mass_before(q + 1)))
      walks.walk(q, sink);
  }
  for (std::uint64_t i = finder.index(); i < last; ++i) consumer.put_in_quad(last_quad);
}

}  // namespace hilbrush
