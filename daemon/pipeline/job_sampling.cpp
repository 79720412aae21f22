#include "daemon/pipeline/job_sampling.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

#include "sampling/tone/levels.h"

namespace hilbrush {
namespace {

/// For dot, pose, exposure, film and pictures; measured on dry runs from 0.1 to 1 million dots.
constexpr double kBytesPerDot = 512;
/// Programs and films number dots with 32 bits.
constexpr std::uint64_t kMaxDots = std::numeric_limits<std::uint32_t>::max();

/// The pitch before the dots are placed. For a job that gives the number of dots it is estimated as if the
/// tone were one half everywhere. It chooses the tone curve, on cells whose spot is given in millimeters.
double expected_pitch_m(const JobSettings& settings, const TexturedMesh& mesh) {
  const SampleOptions options = sample_options(settings);
  if (options.pitch_m) return *options.pitch_m;
  return std::sqrt(.5 * mesh.area_m2() / static_cast<double>(*options.dot_count));
}

/// The pitch that this number of dots has, within a few hundredths: what is asked for below a pitch depends
/// on it, a little, and it on what is asked for.
double pitch_of_count(const TexturedMesh& mesh, ToneOptions options, const std::vector<double>& levels,
                      std::uint64_t count, double first_guess_m) {
  constexpr int kMaxTrials = 3;
  constexpr double kCloseEnough = .02;
  if (levels != std::vector<double>{1}) options.curve = density_curve(options.curve, levels);
  options.pitch_m = first_guess_m;
  for (int trial = 0; trial < kMaxTrials; ++trial) {
    const double mass_m2 = asked_mass_m2(ToneField(mesh, options));
    if (!(mass_m2 > 0)) break;
    const double pitch_m = std::sqrt(mass_m2 / static_cast<double>(count));
    const bool is_close = std::abs(pitch_m / options.pitch_m - 1) < kCloseEnough;
    options.pitch_m = pitch_m;
    if (is_close) break;
  }
  return options.pitch_m;
}

}  // namespace

Sampler calibrated_sampler(Sampler sampler) {
  return sampler == Sampler::kFine ? Sampler::kCentroid : sampler;
}

CellTone job_tone(const CellDescription& cell, const JobSettings& settings, const TexturedMesh& mesh) {
  const double pitch_m = expected_pitch_m(settings, mesh);
  CellTone tone = cell_tone(cell, {.sampler = sampler_name(calibrated_sampler(settings.sampler)),
                                   .curve = curve_name(settings.curve),
                                   .levels = settings.levels,
                                   .spot_pitches = spot_diameter_m(cell, pitch_m) / pitch_m});
  tone.options.untextured = settings.untextured;
  if (settings.tone_curve == ToneMapping::kLinear) {
    tone.options.curve = {{0, 1}, {0, cell.paint.asked_max}};
    tone.warning.clear();
  }
  tone.options.pitch_m = pitch_m;
  if (settings.dots)
    tone.options.pitch_m = pitch_of_count(
        mesh, tone.options, energy_levels(settings.levels, cell.paint.asked_max), *settings.dots, pitch_m);
  return tone;
}

PlacementOptions placement_options(const JobSettings& settings) {
  PlacementOptions options;
  if (settings.size_mm) options.size_m = *settings.size_mm * 1e-3;
  if (settings.units_mm) options.unit_m = *settings.units_mm * 1e-3;
  if (settings.up) options.up = *settings.up == "y" ? UpAxis::kY : UpAxis::kZ;
  return options;
}

PictureOptions picture_options(const CellDescription& cell, const JobSettings& settings) {
  PictureOptions options;
  options.sample = sample_options(settings);
  options.sample.dot_limit = std::min(options.sample.dot_limit, dot_limit_by_memory());
  options.levels = energy_levels(settings.levels, cell.paint.asked_max);
  options.curve = settings.curve;
  options.predictive_rounds = settings.predictive_rounds;
  options.largest_gap_pitches = settings.largest_gap_pitches;
  options.fine_passes = settings.fine_passes;
  options.spot = [&cell](double pitch_m) -> SpotModel {
    return {spot_diameter_m(cell, pitch_m) / 2,
            [response = cell.paint.response](double dose) { return painted_coverage(response, dose); }};
  };
  return options;
}

std::uint64_t dot_limit_by_memory() {
  std::ifstream in("/proc/meminfo");
  std::string key, unit;
  double kilobytes = 0;
  while (in >> key >> kilobytes) {
    if (key == "MemAvailable:")
      return static_cast<std::uint64_t>(
          std::min(kilobytes * 1024 / kBytesPerDot, static_cast<double>(kMaxDots)));
    std::getline(in, unit);
  }
  return kMaxDots;
}

}  // namespace hilbrush
