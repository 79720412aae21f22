#include "sampling/fine/fine.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "sampling/base/check.h"
#include "sampling/base/input_error.h"
#include "sampling/curve/dot_triangle.h"
#include "sampling/curve/surface_place.h"
#include "sampling/fine/paint_model.h"

namespace hilbrush {
namespace {

using Eigen::Vector3f;

/// Length of a dot's step in the first and the last pass, in pitches; in between it falls along half a cosine
/// wave.
constexpr float kFirstStepPitches = .5f;
constexpr float kLastStepPitches = .03f;
/// Passes before the averages of the gradients can be trusted; until then steps are shorter.
constexpr int kWarmUpPasses = 4;
/// Weight of the old value in the running averages of a dot's gradient and of its square: beta1 and beta2 of
/// Adam, shorter than its .9 and .999 because there are only a few dozen passes.
constexpr float kMomentum = .8f;
constexpr float kSteepness = .95f;
/// Steps are divided by at least this share of the rms gradient of all dots, so that a dot whose own gradient
/// is smaller hardly moves.
constexpr float kCommonShare = .5f;

/// Gradient descent with momentum, each dot's step divided by the running rms of its own gradient (Kingma and
/// Ba, "Adam", 2015; one scale for all directions, so that no direction is preferred).
class Descent {
 public:
  Descent(const SurfaceCurve& curve, const ToneField& tone, const DotSequence& dots, const SpotModel& spot)
      : curve_(curve),
        tone_(tone),
        pitch_m_(static_cast<float>(dots.pitch_m)),
        paint_(curve, tone, dots.pitch_m, spot) {
    for (const Dot& dot : dots.dots) {
      places_.push_back({dot.position_O, dot.triangle, dot.component});
      exposures_.push_back({paint_.place_of(dot.position_O), dot.normal_O, dot.level});
    }
    motion_.resize(places_.size(), Vector3f::Zero());
    steepness_.resize(places_.size(), 0);
    gradients_.resize(places_.size());
  }

  double paint() { return paint_.expose(exposures_); }

  void step(int pass, int passes) {
    tbb::parallel_for(std::size_t{0}, places_.size(),
                      [&](std::size_t i) { gradients_[i] = paint_.gradient(exposures_[i]); });
    double square = 0;
    for (const Vector3f& gradient : gradients_) square += static_cast<double>(gradient.squaredNorm());
    const auto common2 = static_cast<float>(square / static_cast<double>(places_.size()));
    if (!(common2 > 0)) return;
    const float done = static_cast<float>(pass) / static_cast<float>(passes);
    const float length = pitch_m_ * std::min(1.f, static_cast<float>(pass + 1) / kWarmUpPasses) *
                         (kLastStepPitches + (kFirstStepPitches - kLastStepPitches) * .5f *
                                                 (1 + std::cos(std::numbers::pi_v<float> * done)));
    // Both averages start at 0; dividing by these shares removes that bias, as in Adam.
    const float motion_share = 1 - std::pow(kMomentum, static_cast<float>(pass + 1));
    const float steepness_share = 1 - std::pow(kSteepness, static_cast<float>(pass + 1));
    tbb::parallel_for(std::size_t{0}, places_.size(), [&](std::size_t i) {
      motion_[i] = kMomentum * motion_[i] + (1 - kMomentum) * gradients_[i];
      steepness_[i] = kSteepness * steepness_[i] + (1 - kSteepness) * gradients_[i].squaredNorm();
      const float steep = std::sqrt(steepness_[i] / steepness_share + kCommonShare * kCommonShare * common2);
      const Vector3f step = -length / (motion_share * steep) * motion_[i];
      if (!move_to(places_[i], curve_.surface(), tone_, places_[i].position_O + step.cast<double>()))
        motion_[i].setZero();
      exposures_[i].place = paint_.place_of(places_[i].position_O);
      exposures_[i].normal = curve_.mesh().area_vector(places_[i].triangle).normalized().cast<float>();
    });
  }

  const std::vector<SurfacePlace>& places() const { return places_; }

 private:
  const SurfaceCurve& curve_;
  const ToneField& tone_;
  const float pitch_m_;
  PaintModel paint_;
  std::vector<SurfacePlace> places_;
  std::vector<PaintModel::Exposure> exposures_;
  std::vector<Vector3f> motion_, gradients_;
  std::vector<float> steepness_;
};

}  // namespace

DotSequence refine_dots(const SurfaceCurve& curve, const ToneField& tone, DotSequence dots,
                        const SpotModel& spot, const FineOptions& options, const Progress& progress) {
  CHECK(&curve.mesh() == &tone.mesh());
  if (!(spot.radius_m > 0) || !std::isfinite(spot.radius_m))
    throw InputError("", "the laser spot must be more than 0 mm wide");
  if (options.passes < 1) throw InputError("", "fine placement needs at least one pass");
  if (dots.dots.empty()) return dots;

  Descent descent(curve, tone, dots, spot);
  double best = descent.paint();
  std::vector<SurfacePlace> best_places;
  for (int pass = 0; pass < options.passes; ++pass) {
    descent.step(pass, options.passes);
    const double error = descent.paint();
    if (error < best) {
      best = error;
      best_places = descent.places();
    }
    progress(static_cast<double>(pass + 1) / options.passes);
  }
  tbb::parallel_for(std::size_t{0}, best_places.size(), [&](std::size_t i) {
    const SurfacePlace& place = best_places[i];
    const float level = dots.dots[i].level;
    dots.dots[i] =
        make_dot(curve.surface(), tone, surface_point_at(curve.mesh(), place.triangle, place.position_O),
                 place.component);
    dots.dots[i].level = level;
  });
  return dots;
}

}  // namespace hilbrush
