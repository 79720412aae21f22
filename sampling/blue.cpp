#include "sampling/blue.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "sampling/check.h"
#include "sampling/curve/sequence.h"
#include "sampling/relax/colouring.h"
#include "sampling/relax/gaussian_sum.h"
#include "sampling/relax/stratum_places.h"

namespace hilbrush {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3d;
using Eigen::Vector3f;

/// Of the kernel between two dots at unit spacing. Less makes dots keep more distance and lets more noise of low
/// frequencies through, more the reverse.
constexpr double kSigma = .5;
constexpr int kChoiceSweeps = 3, kNewtonSweeps = 3;
/// How far Newton steps may take a dot from the place that was chosen, and a single one, in spacings.
constexpr double kLongestWay = .25, kLongestStep = .15;
/// Dots whose spacings differ by more do not see each other: what they would push, the surface around them would pull.
constexpr double kMostUnequal = 4;
/// Surface pulls from so many places a stratum.
constexpr std::size_t kPulls = 4;

/// Two spacings h, k have the kernel 2hk/(h2 + k2) exp(-r2 / (2 sigma2 (h2 + k2)/2)), which is positive definite
/// whatever the spacings (Gibbs 1997, equation 3.82).
struct PairKernel {
  PairKernel(double h, double k)
      : weight(2 * h * k / (h * h + k * k)),
        support2(GaussianSum::kExponent * kSigma * kSigma * (h * h + k * k)),
        inverse_square(1 / support2) {}
  double weight, support2, inverse_square;
};

/// What a single dot reaches at most: support of a pair <= reach of one + reach of the other.
double reach_of(const PlacedStratum& stratum) {
  return stratum.radius_m + (std::sqrt(GaussianSum::kExponent) * kSigma + kLongestWay) * stratum.spacing_m;
}

IndexLists find_neighbours(const std::vector<PlacedStratum>& strata) {
  std::vector<Ball> balls;
  balls.reserve(strata.size());
  for (const PlacedStratum& stratum : strata) balls.push_back({stratum.middle_O, reach_of(stratum)});
  return find_touching_balls(balls, [&](std::uint32_t i, std::uint32_t j) {
    const PlacedStratum &a = strata[i], &b = strata[j];
    const double ratio = a.spacing_m / b.spacing_m;
    if (!(ratio < kMostUnequal && ratio * kMostUnequal > 1 && a.normal_O.dot(b.normal_O) > 0)) return false;
    const double reach = std::sqrt(PairKernel(a.spacing_m, b.spacing_m).support2) + a.radius_m + b.radius_m +
                         kLongestWay * (a.spacing_m + b.spacing_m);
    return (a.middle_O - b.middle_O).squaredNorm() < reach * reach;
  });
}

/// What place_dots would place.
std::uint64_t count_dots(const SurfaceCurve& curve, const ToneField& tone, const SampleOptions& options) {
  SampleOptions few = options;
  few.sampler = Sampler::kEven;
  if (options.pitch_m && !options.dot_count) {
    few.pitch_m = 1e6;
    if (place_dots(curve, tone, few).dots.empty()) return 0;
    few.pitch_m.reset();
    few.dot_count = 1;
    const double root_mass_m = place_dots(curve, tone, few).pitch_m;
    return std::max<std::uint64_t>(1, std::llround(std::pow(root_mass_m / *options.pitch_m, 2)));
  }
  return *options.dot_count;
}

class Relaxation {
 public:
  Relaxation(const SurfaceCurve& curve, const ToneField& tone, const PlacedStrata& strata, std::uint64_t seed)
      : curve_(curve),
        tone_(tone),
        strata_(strata),
        neighbours_(find_neighbours(strata.strata)),
        colouring_(colour_stretches(neighbours_)),
        pulls_(strata.strata.size()),
        dots_(strata.strata.size()) {
    tbb::parallel_for(std::size_t{0}, dots_.size(), [&](std::size_t i) {
      find_pulls(i);
      dots_[i] = strata_.place(i, any_open_place(i, uniform_number(seed, i)));
    });
  }

  void choose(const Progress& progress) {
    std::vector<std::array<float, kPlacesAStratum>> pull(dots_.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, dots_.size(), Colouring::kStretch),
                      [&](const tbb::blocked_range<std::size_t>& range) {
                        GaussianSum sum;
                        for (std::size_t i = range.begin(); i < range.end(); ++i) pull[i] = pull_of_places(i, sum);
                      });
    for (int sweep = 0; sweep < kChoiceSweeps; ++sweep)
      visit_all(progress, sweep, [&](std::size_t i, GaussianSum& sum) { choose_place(i, pull[i], sum); });
  }

  void refine(const Progress& progress) {
    const std::vector<SurfacePlace> chosen = dots_;
    for (int sweep = 0; sweep < kNewtonSweeps; ++sweep)
      visit_all(progress, kChoiceSweeps + sweep,
                [&](std::size_t i, GaussianSum& sum) { step(i, chosen[i].position_O, sum); });
  }

  const std::vector<SurfacePlace>& dots() const { return dots_; }

 private:
  /// Where the surface of a stratum pulls from, and how strongly.
  struct Pull {
    Vector3d position_O;
    double share = 0;
  };

  void find_pulls(std::size_t i) {
    constexpr std::size_t kTogether = kPlacesAStratum / kPulls;
    for (std::size_t k = 0; k < kPulls; ++k) {
      Vector3d sum = Vector3d::Zero();
      int count = 0;
      for (std::size_t p = k * kTogether; p < (k + 1) * kTogether; ++p)
        if (is_open(i, p)) sum += strata_.place(i, p).position_O, ++count;
      if (count > 0) pulls_[i][k] = {sum / count, static_cast<double>(count) / kPlacesAStratum};
    }
  }

  bool is_open(std::size_t i, std::size_t p) const { return strata_.strata[i].open_places >> p & 1u; }
  std::size_t any_open_place(std::size_t i, double number) const {
    auto p = static_cast<std::size_t>(number * kPlacesAStratum);
    while (!is_open(i, p)) p = (p + 1) % kPlacesAStratum;
    return p;
  }

  /// Coordinates about a stratum's middle, z along its normal.
  struct Frame {
    explicit Frame(const PlacedStratum& stratum) : middle_O(stratum.middle_O), axes(frame_about(stratum.normal_O)) {}
    Vector3f operator()(const Vector3d& p_O) const { return (axes.transpose() * (p_O - middle_O)).cast<float>(); }
    Vector3d middle_O;
    Eigen::Matrix3d axes;
  };

  /// Adds kernels at `position_O` to the sum if they can reach anything within radius_m of the frame's middle.
  static void add_near(GaussianSum& sum, const Frame& frame, const PairKernel& kernel, double radius_m,
                       const Vector3d& position_O, double sign) {
    const double reach = std::sqrt(kernel.support2) + radius_m;
    if ((position_O - frame.middle_O).squaredNorm() > reach * reach) return;
    sum.add(frame(position_O), static_cast<float>(kernel.inverse_square), static_cast<float>(sign * kernel.weight));
  }

  void add_pulls(GaussianSum& sum, const Frame& frame, std::size_t i, std::size_t j, double radius_m) const {
    const PairKernel kernel(strata_.strata[i].spacing_m, strata_.strata[j].spacing_m);
    for (const Pull& pull : pulls_[j])
      if (pull.share > 0) add_near(sum, frame, kernel, radius_m, pull.position_O, -pull.share);
  }
  void add_dots(GaussianSum& sum, const Frame& frame, std::size_t i, double radius_m) const {
    for (const std::uint32_t j : neighbours_[i])
      add_near(sum, frame, PairKernel(strata_.strata[i].spacing_m, strata_.strata[j].spacing_m), radius_m,
               dots_[j].position_O, 1);
  }

  std::array<float, kPlacesAStratum> pull_of_places(std::size_t i, GaussianSum& sum) const {
    const PlacedStratum& stratum = strata_.strata[i];
    const Frame frame(stratum);
    sum.clear();
    add_pulls(sum, frame, i, i, stratum.radius_m);
    for (const std::uint32_t j : neighbours_[i]) add_pulls(sum, frame, i, j, stratum.radius_m);
    std::array<float, kPlacesAStratum> pull{};
    for (std::size_t p = 0; p < kPlacesAStratum; ++p)
      if (is_open(i, p)) pull[p] = sum(frame(strata_.place(i, p).position_O));
    return pull;
  }

  void choose_place(std::size_t i, const std::array<float, kPlacesAStratum>& pull, GaussianSum& sum) {
    const PlacedStratum& stratum = strata_.strata[i];
    const Frame frame(stratum);
    sum.clear();
    add_dots(sum, frame, i, stratum.radius_m);
    float least = std::numeric_limits<float>::infinity();
    for (std::size_t p = 0; p < kPlacesAStratum; ++p) {
      if (!is_open(i, p)) continue;
      const float energy = pull[p] + sum(frame(strata_.place(i, p).position_O));
      if (energy < least) least = energy, dots_[i] = strata_.place(i, p);
    }
  }

  /// One Newton step, down along both axes of curvature.
  void step(std::size_t i, const Vector3d& home_O, GaussianSum& sum) {
    PlacedStratum here = strata_.strata[i];
    here.middle_O = dots_[i].position_O;
    const Frame frame(here);
    sum.clear();
    add_dots(sum, frame, i, 0);
    add_pulls(sum, frame, i, i, 0);
    for (const std::uint32_t j : neighbours_[i]) add_pulls(sum, frame, i, j, 0);
    const GaussianSum::Slope slope = sum.slope(Vector3f::Zero());

    const double h = here.spacing_m;
    // Curvatures below a third of the kernel's own are no guide to how far the valley is.
    const float least = static_cast<float>(.3 / (2 * kSigma * kSigma * h * h));
    const Vector2f way = newton_step(slope, least);
    Vector3d offset = frame.axes.leftCols<2>() * way.cast<double>();
    offset *= std::min(1., kLongestStep * h / std::max(offset.norm(), 1e-300));
    Vector3d from_home = here.middle_O + offset - home_O;
    from_home *= std::min(1., kLongestWay * h / std::max(from_home.norm(), 1e-300));
    move_to(dots_[i], curve_, tone_, home_O + from_home);
  }

  static Vector2f newton_step(const GaussianSum::Slope& slope, float least_curvature) {
    const float mean = .5f * (slope.xx + slope.yy), half = .5f * (slope.xx - slope.yy);
    const float spread = std::hypot(half, slope.xy);
    const float turn = .5f * std::atan2(slope.xy, half);
    const Vector2f axis(std::cos(turn), std::sin(turn)), other(-axis.y(), axis.x());
    const auto along = [&](const Vector2f& direction, float curvature) {
      return Vector2f(-slope.gradient.dot(direction) / std::max(std::abs(curvature), least_curvature) * direction);
    };
    return along(axis, mean + spread) + along(other, mean - spread);
  }

  template <class Visit>
  void visit_all(const Progress& progress, int sweep, Visit visit) {
    for (const auto& stretches : colouring_.stretches)
      tbb::parallel_for(std::size_t{0}, stretches.size(), [&](std::size_t s) {
        GaussianSum sum;
        const std::size_t begin = stretches[s] * Colouring::kStretch;
        for (std::size_t i = begin; i < std::min(begin + Colouring::kStretch, dots_.size()); ++i) visit(i, sum);
      });
    if (progress) progress(.5 + .5 * (sweep + 1) / (kChoiceSweeps + kNewtonSweeps));
  }

  const SurfaceCurve& curve_;
  const ToneField& tone_;
  const PlacedStrata& strata_;
  const IndexLists neighbours_;
  const Colouring colouring_;
  std::vector<std::array<Pull, kPulls>> pulls_;
  std::vector<SurfacePlace> dots_;
};

}  // namespace

DotSequence place_blue(const SurfaceCurve& curve, const ToneField& tone, const SampleOptions& options,
                       SampleReport* report, const Progress& progress) {
  const std::uint64_t count = count_dots(curve, tone, options);
  DotSequence sequence;
  SampleReport figures;
  sequence.pitch_m = options.pitch_m.value_or(0);
  if (count == 0) {
    if (report) *report = figures;
    return sequence;
  }
  const auto first_half = [&](double fraction) {
    if (progress) progress(.5 * fraction);
  };
  const PlacedStrata strata = place_strata(curve, tone, options, count, figures, first_half);
  Relaxation relaxation(curve, tone, strata, options.seed);
  relaxation.choose(progress);
  relaxation.refine(progress);

  const std::vector<SurfacePlace>& places = relaxation.dots();
  sequence.dots.resize(count);
  tbb::parallel_for(std::size_t{0}, sequence.dots.size(), [&](std::size_t i) {
    sequence.dots[i] =
        make_dot(curve.implementation(), tone, surface_point_at(curve.mesh(), places[i].triangle, places[i].position_O),
                 places[i].component);
  });
  if (!options.pitch_m) sequence.pitch_m = strata.pitch_m;
  if (report) *report = figures;
  return sequence;
}

}  // namespace hilbrush
