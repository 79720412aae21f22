#include "sampling/place_picture.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "sampling/laminar/laminar.h"
#include "sampling/place_dots.h"
#include "sampling/tone/levels.h"

namespace hilbrush {
namespace {

/// The field that decides the number of dots, if it differs from that of the energy.
std::optional<ToneField> density_field(const ToneField& tone, ToneOptions options,
                                       const std::vector<double>& levels) {
  if (levels == std::vector<double>{1}) return std::nullopt;
  options.curve = density_curve(options.curve, levels);
  return std::optional<ToneField>(std::in_place, tone.mesh(), options);
}

std::vector<std::uint64_t> count_levels(const DotSequence& dots, const std::vector<double>& levels) {
  std::vector<std::uint64_t> counts(levels.size());
  for (const Dot& dot : dots.dots) {
    const auto nearest = std::min_element(levels.begin(), levels.end(), [&](double a, double b) {
      return std::abs(a - dot.level) < std::abs(b - dot.level);
    });
    ++counts[static_cast<std::size_t>(nearest - levels.begin())];
  }
  return counts;
}

}  // namespace

DotSequence place_picture(const SurfaceCurve& curve, const ToneField& tone, const ToneOptions& tone_options,
                          const PictureOptions& options, const PicturePredictor& predict,
                          PictureReport* report, const Progress& progress) {
  PictureReport figures;
  SampleOptions sample = options.sample;
  const bool is_fine = sample.sampler == Sampler::kFine;
  if (is_fine) sample.sampler = Sampler::kCentroid;
  // n rounds place n + 1 times; each is an equal part of the progress, and so is the search.
  const double parts = options.predictive_rounds + 1 + (is_fine ? 1 : 0);
  int part = 0;
  const auto next_part = [&] {
    ++part;
    return progress.part((part - 1) / parts, part / parts);
  };
  const auto place = [&](const ToneField& density) {
    if (options.curve == CurveKind::kLaminar)
      return place_laminar(curve.mesh(), density, sample, &figures.path, next_part());
    DotSequence dots = place_dots(curve, density, sample, &figures.path, next_part());
    if (!options.largest_gap_pitches) return dots;
    return fill_holes(curve, density, std::move(dots), *options.largest_gap_pitches, &figures.filled);
  };
  const std::optional<ToneField> density = density_field(tone, tone_options, options.levels);
  const PredictiveOptions predictive{.rounds = options.predictive_rounds, .levels = options.levels};
  DotSequence dots = place_predictively(tone, density ? *density : tone, tone_options.curve, predictive,
                                        place, predict, &figures.predictive);
  if (is_fine && !dots.dots.empty()) {
    const SpotModel spot = options.spot(dots.pitch_m);
    dots = refine_dots(curve, tone, std::move(dots), spot, {.passes = options.fine_passes}, next_part());
  }
  // Since they were placed, filling holes has added dots, and the predictive loop and the search have moved
  // some.
  PathMeter meter(figures.path);
  meter.follow(dots.dots);
  meter.finish();
  figures.dots_of_level = count_levels(dots, options.levels);
  if (report) *report = std::move(figures);
  return dots;
}

}  // namespace hilbrush
