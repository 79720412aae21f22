#include "sampling/place_picture.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sampling/levels.h"

namespace hilbrush {
namespace {

/// The field of the number of dots, if it is another than that of the energy.
std::optional<ToneField> density_field(const ToneField& tone, ToneOptions options, const std::vector<double>& levels) {
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
                          const PictureOptions& options, const PicturePredictor& predict, PictureReport* report,
                          const Progress& progress) {
  PictureReport figures;
  // The places of a loop of n rounds are n + 1; each tells its own share of the progress.
  int placed = 0;
  const auto place = [&](const ToneField& density) {
    const double begin = placed, count = options.predictive_rounds + 1;
    ++placed;
    const auto part = [&](double fraction) {
      if (progress) progress((begin + fraction) / count);
    };
    return place_dots(curve, density, options.sample, &figures.path, part);
  };
  const std::optional<ToneField> density = density_field(tone, tone_options, options.levels);
  const PredictiveOptions predictive{.rounds = options.predictive_rounds, .levels = options.levels};
  DotSequence dots = place_predictively(tone, density ? *density : tone, tone_options.curve, predictive, place, predict,
                                        &figures.predictive);
  figures.dots_of_level = count_levels(dots, options.levels);
  if (report) *report = std::move(figures);
  return dots;
}

}  // namespace hilbrush
