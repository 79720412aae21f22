#include "sampling/blue/blue.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "sampling/base/check.h"
#include "sampling/base/frame.h"
#include "sampling/blue/coloring.h"
#include "sampling/blue/kernel.h"
#include "sampling/blue/stratum_places.h"
#include "sampling/curve/dot_triangle.h"
#include "sampling/curve/sequence.h"
#include "sampling/model/growing_ball.h"

namespace hilbrush {
namespace {

using Eigen::Vector3d;

constexpr int kChoiceSweeps = 3;
constexpr int kNewtonSweeps = 3;
/// At the end two dots are pushed apart if they are nearer than this share of their distance in the densest
/// packing. The kernel, which is flat on top, leaves a few such pairs in 100,000.
constexpr double kMinDistance = .58;
/// In spacings. A place that is farther from all dots attracts the dot of its stratum. Most such holes lie on
/// the border of the surface: there no neighbor on the other side pushes the dots back.
constexpr double kMaxDistance = .78;
constexpr int kEveningRounds = 3;
/// A dot that moves away from one neighbor may come too near to another, so the last sweeps only push dots
/// apart.
constexpr int kLastPushes = 3;
constexpr int kSweeps = kChoiceSweeps + kNewtonSweeps + 2 * kEveningRounds + kLastPushes;
/// In spacings of a place: border that is farther away is not looked for.
constexpr double kToBorder = .4;
/// In spacings: how far all Newton steps together may move a dot from the place that was chosen, and a single
/// one.
constexpr double kMaxOffset = .25;
constexpr double kMaxStep = .15;
/// Dots whose spacings differ by a larger factor do not push each other: the pull of the surface around them
/// would undo it.
constexpr double kMaxUnequal = 4;
/// Distance of neighbors in the densest packing, at unit area a dot: sqrt(2 / sqrt(3)).
constexpr double kDensestSpacing = 1.0745699318235418;

/// The largest reach of one dot: two dots push each other only if the distance of their strata is less than
/// the sum of their reaches.
double reach_of(const PlacedStratum& stratum) {
  // The kernel of two dots that are as unequal as may be reaches furthest beyond the sum of equal ones.
  static const double kMaxReach =
      std::sqrt(static_cast<double>(PairKernel(1., kMaxUnequal).support2)) / (1 + kMaxUnequal);
  return stratum.radius_m + kMaxReach * stratum.spacing_m;
}

/// Strata whose dots push each other: those that face the same way or are connected over a fold, not those on
/// two sides of a wall.
IndexLists neighboring_strata(const SurfaceCurve& curve, const PlacedStrata& strata) {
  std::vector<SizedBall> balls;
  balls.reserve(strata.strata.size());
  for (const PlacedStratum& stratum : strata.strata) balls.push_back({stratum.middle_O, reach_of(stratum)});
  tbb::enumerable_thread_specific<GrowingBall> growing_balls(
      [&] { return GrowingBall(curve.mesh(), curve.surface().neighbors); });
  const auto first_place = [&](std::uint32_t i) -> const SurfacePlace& {
    return strata.place(i, static_cast<std::size_t>(std::countr_zero(strata.strata[i].open_places)));
  };
  return find_touching_balls(balls, [&](std::uint32_t i, std::uint32_t j) {
    const PlacedStratum &a = strata.strata[i], &b = strata.strata[j];
    const double ratio = a.spacing_m / b.spacing_m;
    if (!(ratio < kMaxUnequal && ratio * kMaxUnequal > 1)) return false;
    const double reach = static_cast<double>(std::sqrt(PairKernel(a.spacing_m, b.spacing_m).support2)) +
                         a.radius_m + b.radius_m;
    if (!((a.middle_O - b.middle_O).squaredNorm() < reach * reach)) return false;
    if (a.normal_O.dot(b.normal_O) > 0) return true;
    const SurfacePlace& from = first_place(std::min(i, j));
    GrowingBall& ball = growing_balls.local();
    ball.begin(from.position_O, from.triangle);
    return std::isfinite(ball.entry2(first_place(std::max(i, j)).triangle, reach * reach));
  });
}

class Relaxation {
 public:
  Relaxation(const SurfaceCurve& curve, const ToneField& tone, const PlacedStrata& strata, std::uint64_t seed)
      : curve_(curve),
        tone_(tone),
        strata_(strata),
        neighbors_(neighboring_strata(curve, strata)),
        coloring_(color_stretches(neighbors_)),
        pulls_(strata.strata.size()),
        dots_(strata.strata.size()) {
    tbb::parallel_for(std::size_t{0}, dots_.size(), [&](std::size_t i) {
      find_pulls(i);
      dots_[i] = strata_.place(i, any_open_place(i, uniform_number(seed, i)));
    });
    find_border();
  }

  void choose(const Progress& progress) {
    std::vector<PlaceSums::Sums> pull(dots_.size());
    tbb::parallel_for(std::size_t{0}, dots_.size(), [&](std::size_t i) { pull[i] = pull_of_places(i); });
    for (int sweep = 0; sweep < kChoiceSweeps; ++sweep)
      visit_all(progress, sweep, [&](std::size_t i) { choose_place(i, pull[i]); });
  }

  void refine(const Progress& progress) {
    const std::vector<SurfacePlace> chosen = dots_;
    for (int sweep = 0; sweep < kNewtonSweeps; ++sweep)
      visit_all(progress, kChoiceSweeps + sweep, [&](std::size_t i) { step(i, chosen[i].position_O); });
  }

  void even_out(const Progress& progress) {
    for (int round = 0; round < kEveningRounds; ++round) {
      visit_all(progress, kChoiceSweeps + kNewtonSweeps + 2 * round, [&](std::size_t i) { close_hole(i); });
      visit_all(progress, kChoiceSweeps + kNewtonSweeps + 2 * round + 1,
                [&](std::size_t i) { leave_nearest(i); });
    }
    for (int sweep = kSweeps - kLastPushes; sweep < kSweeps; ++sweep)
      visit_all(progress, sweep, [&](std::size_t i) { leave_nearest(i); });
  }

  const std::vector<SurfacePlace>& dots() const { return dots_; }

 private:
  void find_pulls(std::size_t i) {
    constexpr std::size_t kTogether = kPlacesAStratum / FourPulls::kCount;
    for (std::size_t k = 0; k < FourPulls::kCount; ++k) {
      Vector3d sum = Vector3d::Zero();
      int count = 0;
      for (std::size_t p = k * kTogether; p < (k + 1) * kTogether; ++p)
        if (is_open(i, p)) {
          sum += strata_.place(i, p).position_O - strata_.strata[i].middle_O;
          ++count;
        }
      if (count == 0) continue;
      const Eigen::Vector3f place = (sum / count).cast<float>();
      const auto row = static_cast<Eigen::Index>(k);
      pulls_[i].x[row] = place.x();
      pulls_[i].y[row] = place.y();
      pulls_[i].z[row] = place.z();
      pulls_[i].share[row] = static_cast<float>(count) / kPlacesAStratum;
    }
  }

  bool is_open(std::size_t i, std::size_t p) const { return strata_.strata[i].open_places >> p & 1u; }
  std::size_t any_open_place(std::size_t i, double number) const {
    auto p = static_cast<std::size_t>(number * kPlacesAStratum);
    while (!is_open(i, p)) p = (p + 1) % kPlacesAStratum;
    return p;
  }

  PairKernel kernel_of(std::size_t i, std::size_t j) const {
    return {strata_.strata[i].spacing_m, strata_.strata[j].spacing_m};
  }
  /// The surface of j pulls at i.
  void add_pulls(PlaceSums& sum, const PairKernel& kernel, std::size_t j) const {
    for (Eigen::Index k = 0; k < static_cast<Eigen::Index>(FourPulls::kCount); ++k)
      sum.add(kernel, strata_.strata[j].middle_O + pulls_[j].place(k), -pulls_[j].share[k]);
  }
  void add_pulls(TangentSlope& slope, const PairKernel& kernel, std::size_t j) const {
    slope.subtract(kernel, strata_.strata[j].middle_O, pulls_[j]);
  }

  PlaceSums::Sums pull_of_places(std::size_t i) const {
    PlaceSums sum(strata_, i);
    add_pulls(sum, kernel_of(i, i), i);
    for (const std::uint32_t j : neighbors_[i]) add_pulls(sum, kernel_of(i, j), j);
    return sum.sums();
  }

  void choose_place(std::size_t i, const PlaceSums::Sums& pull) {
    PlaceSums sum(strata_, i);
    for (const std::uint32_t j : neighbors_[i]) sum.add(kernel_of(i, j), dots_[j].position_O, 1);
    const PlaceSums::Sums energy = sum.sums() + pull;
    float least = std::numeric_limits<float>::infinity();
    for (std::size_t p = 0; p < kPlacesAStratum; ++p) {
      if (!is_open(i, p) || !(energy[static_cast<Eigen::Index>(p)] < least)) continue;
      least = energy[static_cast<Eigen::Index>(p)];
      dots_[i] = strata_.place(i, p);
    }
  }

  void step(std::size_t i, const Vector3d& home_O) {
    const Vector3d here_O = dots_[i].position_O;
    const Eigen::Matrix3d axes = frame_about(strata_.strata[i].normal_O);
    TangentSlope slope(here_O, axes.col(0), axes.col(1));
    add_pulls(slope, kernel_of(i, i), i);
    for (const std::uint32_t j : neighbors_[i]) {
      const PairKernel kernel = kernel_of(i, j);
      slope.add(kernel, dots_[j].position_O);
      // The surface of many neighbors is out of reach of this one place of the stratum.
      const double reach = static_cast<double>(std::sqrt(kernel.support2)) + strata_.strata[j].radius_m;
      if ((strata_.strata[j].middle_O - here_O).squaredNorm() < reach * reach) add_pulls(slope, kernel, j);
    }
    const double h = strata_.strata[i].spacing_m;
    // Curvatures below a third of a single kernel's say nothing about how far the minimum is.
    const auto least = static_cast<float>(.15 / (static_cast<double>(PairKernel::kSigma2) * h * h));
    Vector3d offset = axes.leftCols<2>() * slope.newton_step(least).cast<double>();
    offset *= std::min(1., kMaxStep * h / std::max(offset.norm(), 1e-300));
    Vector3d from_home = here_O + offset - home_O;
    from_home *= std::min(1., kMaxOffset * h / std::max(from_home.norm(), 1e-300));
    move_to(dots_[i], curve_.surface(), tone_, home_O + from_home);
  }

  /// Places on the border beside each stratum, where walks outwards and to both sides from its open places
  /// end.
  void find_border() {
    const Surface& surface = curve_.surface();
    const auto has_border = [](const auto& sides) {
      return std::ranges::find(sides, kNoSide) != sides.end();
    };
    border_.resize(dots_.size());
    if (std::ranges::none_of(surface.neighbors, has_border)) return;
    tbb::parallel_for(std::size_t{0}, dots_.size(), [&](std::size_t i) {
      const PlacedStratum& stratum = strata_.strata[i];
      for (std::size_t p = 0; p < kPlacesAStratum; ++p) {
        if (!is_open(i, p)) continue;
        const SurfacePlace& place = strata_.place(i, p);
        const Vector3d outwards = (place.position_O - stratum.middle_O).normalized();
        const Vector3d across = stratum.normal_O.cross(outwards);
        for (const Vector3d& way : {outwards, across, Vector3d(-across)}) {
          const SurfacePoint end = walk_towards(surface, {place.triangle, {}},
                                                place.position_O + kToBorder * stratum.spacing_m * way);
          const bool is_on_border =
              has_border(surface.neighbors[end.triangle]) && end.barycentric.minCoeff() <= 0;
          if (is_on_border) border_[i].push_back(position(surface.mesh, end));
        }
      }
    });
  }

  /// Finds the place of the stratum, or of the border beside it, that is farthest from all dots. If it is too
  /// far away, the stratum's own dot moves near enough.
  void close_hole(std::size_t i) {
    const double enough = kMaxDistance * strata_.strata[i].spacing_m;
    const Vector3d here_O = dots_[i].position_O;
    double worst = enough;
    Vector3d hole_O = here_O;
    const auto look_at = [&](const Vector3d& place_O) {
      double nearest2 = (here_O - place_O).squaredNorm();
      for (const std::uint32_t j : neighbors_[i]) {
        if (nearest2 <= worst * worst) return;
        nearest2 = std::min(nearest2, (dots_[j].position_O - place_O).squaredNorm());
      }
      if (nearest2 > worst * worst) {
        worst = std::sqrt(nearest2);
        hole_O = place_O;
      }
    };
    for (std::size_t p = 0; p < kPlacesAStratum; ++p)
      if (is_open(i, p)) look_at(strata_.place(i, p).position_O);
    for (const Vector3d& place_O : border_[i]) look_at(place_O);
    if (worst > enough) {
      const Vector3d way = hole_O - here_O;
      move_to(dots_[i], curve_.surface(), tone_, here_O + (1 - enough / way.norm()) * way);
    }
  }

  void leave_nearest(std::size_t i) {
    const Vector3d here_O = dots_[i].position_O;
    double worst = 0;
    Vector3d away = Vector3d::Zero();
    for (const std::uint32_t j : neighbors_[i]) {
      const double least =
          kMinDistance * kDensestSpacing * .5 * (strata_.strata[i].spacing_m + strata_.strata[j].spacing_m);
      const Vector3d way = here_O - dots_[j].position_O;
      const double squared = way.squaredNorm();
      if (squared >= least * least || !(squared > 0)) continue;
      const double distance = std::sqrt(squared);
      if (least - distance <= worst) continue;
      worst = least - distance;
      away = worst / distance * way;
    }
    if (worst > 0) move_to(dots_[i], curve_.surface(), tone_, here_O + away);
  }

  template <class Visit>
  void visit_all(const Progress& progress, int sweep, Visit visit) {
    for (const auto& stretches : coloring_.stretches)
      tbb::parallel_for(std::size_t{0}, stretches.size(), [&](std::size_t s) {
        const std::size_t begin = stretches[s] * Coloring::kStretch;
        for (std::size_t i = begin; i < std::min(begin + Coloring::kStretch, dots_.size()); ++i) visit(i);
      });
    progress(static_cast<double>(sweep + 1) / kSweeps);
  }

  const SurfaceCurve& curve_;
  const ToneField& tone_;
  const PlacedStrata& strata_;
  const IndexLists neighbors_;
  const Coloring coloring_;
  std::vector<FourPulls> pulls_;  ///< where the surface of a stratum pulls from, and how strongly
  std::vector<std::vector<Vector3d>> border_;
  std::vector<SurfacePlace> dots_;
};

std::vector<Dot> dots_at(const SurfaceCurve& curve, const ToneField& tone,
                         const std::vector<SurfacePlace>& places) {
  std::vector<Dot> dots(places.size());
  tbb::parallel_for(std::size_t{0}, dots.size(), [&](std::size_t i) {
    const SurfacePlace& place = places[i];
    dots[i] = make_dot(curve.surface(), tone,
                       surface_point_at(curve.mesh(), place.triangle, place.position_O), place.component);
  });
  return dots;
}

}  // namespace

DotSequence place_blue(const SurfaceCurve& curve, const ToneField& tone, const SampleOptions& options,
                       SampleReport* report, const Progress& progress) {
  const CurveMass mass(curve, tone);
  const std::uint64_t count = count_dots(mass, options);
  DotSequence sequence;
  SampleReport figures;
  sequence.pitch_m = pitch_of(mass, options, count);
  if (count > 0) {
    const PlacedStrata strata = place_strata(mass, tone, options, count, figures, progress.part(0, .5));
    Relaxation relaxation(curve, tone, strata, options.seed);
    const Progress second_half = progress.part(.5, 1);
    relaxation.choose(second_half);
    relaxation.refine(second_half);
    relaxation.even_out(second_half);
    sequence.dots = dots_at(curve, tone, relaxation.dots());
    // In place of the path that the walk along the strata has measured.
    PathMeter meter(figures);
    meter.follow(sequence.dots);
    meter.finish();
  }
  if (report) *report = figures;
  return sequence;
}

}  // namespace hilbrush
