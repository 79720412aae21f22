#include "sampling/tone/levels.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "sampling/base/check.h"
#include "sampling/tone/triangle_frame.h"

namespace hilbrush {
namespace {

/// Width, in wanted tone, of the ramp by which the density falls where the next level takes over: a curve has
/// no jumps.
constexpr double kRamp = 1e-5;

/// Energy a dot here stands for: coverage asked over dots placed, within half a pitch and the dot's triangle.
double local_energy(const Dot& dot, double pitch_m, const ToneField& asked, const ToneField& density) {
  const TriangleFrame frame(asked.mesh(), dot.triangle);
  const Eigen::Vector2d center = frame.place(
                            foot_of_perpendicular(asked.mesh(), dot.triangle, dot.position_O).barycentric),
                        half = Eigen::Vector2d::Constant(pitch_m / 2);
  const BoxedPolygon around = frame.clip_box(center - half, center + half);
  const double dots = density.integrate(dot.triangle, around.corners()).mass;
  return dots > 0 ? asked.integrate(dot.triangle, around.corners()).mass / dots : 0;
}

double nearest_level(std::span<const double> levels, double energy) {
  return *std::min_element(levels.begin(), levels.end(),
                           [&](double a, double b) { return std::abs(a - energy) < std::abs(b - energy); });
}

/// Where the tone changes within the box of a dot, its energy is an estimate. What the estimates miss of the
/// total, a few thousandths, is shared among these dots; those in flat tone have one level exactly and keep
/// it.
void share_missing_energy(DotSequence& dots, const ToneField& asked, std::span<const double> levels) {
  constexpr double kFlat = 1e-3;
  double total = 0;
  std::vector<std::size_t> estimated;
  for (std::size_t i = 0; i < dots.dots.size(); ++i) {
    const double energy = dots.dots[i].level;
    total += energy;
    if (std::abs(energy - nearest_level(levels, energy)) > kFlat * energy) estimated.push_back(i);
  }
  if (estimated.empty()) return;
  const double each =
      (asked_mass_m2(asked) / (dots.pitch_m * dots.pitch_m) - total) / static_cast<double>(estimated.size());
  for (const std::size_t i : estimated) dots.dots[i].level += static_cast<float>(each);
}

}  // namespace

std::vector<double> energy_levels(int count, double asked_max) {
  CHECK_LE(1, count);
  CHECK_LE(count, kMaxLevels);
  if (count == 1) return {1};
  std::vector<double> levels;  // for paint whose black takes twice the full energy
  if (count == 2) levels = {.75, 3};
  if (count == 3) levels = {.8, 1.6, 3};
  if (count == 4) levels = {.67, 1.1, 2, 3};
  for (double& level : levels) level *= asked_max / 2;
  return levels;
}

std::size_t level_for(std::span<const double> levels, double asked) {
  constexpr double kRounding = 1e-9;  // a tone at the very end of a level still belongs to it
  const auto enough =
      std::lower_bound(levels.begin(), levels.end() - 1, asked / kEnoughDots * (1 - kRounding));
  return static_cast<std::size_t>(enough - levels.begin());
}

double dots_for(std::span<const double> levels, double asked) {
  return asked / levels[level_for(levels, asked)];
}

ToneCurve density_curve(const ToneCurve& curve, std::span<const double> levels) {
  const ToneCurve asked = curve.wanted.empty() ? ToneCurve{{0, 1}, {0, 1}} : curve;
  // Knots: the curve's own, and two at each place where a level is used up.
  ToneCurve density;
  const auto add = [&](double wanted, double dots) {
    if (!density.wanted.empty() && wanted <= density.wanted.back()) return;
    density.wanted.push_back(wanted), density.asked.push_back(dots);
  };
  std::size_t level = 0;
  for (std::size_t k = 0; k < asked.wanted.size(); ++k) {
    while (level + 1 < levels.size() && asked.asked[k] > kEnoughDots * levels[level]) {
      const double taken_over = asked.inverse(kEnoughDots * levels[level]);
      add(taken_over, kEnoughDots);
      const double next = std::min(taken_over + kRamp, asked.wanted[k]);
      add(next, asked(next) / levels[level + 1]);
      ++level;
    }
    add(asked.wanted[k], asked.asked[k] / levels[level]);
  }
  return density;
}

void assign_levels(DotSequence& dots, const ToneField& asked, const ToneField& density,
                   std::span<const double> levels) {
  CHECK(&asked.mesh() == &density.mesh());
  if (levels.size() < 2) {
    for (Dot& dot : dots.dots) dot.level = static_cast<float>(levels.front());
    return;
  }
  tbb::parallel_for(std::size_t{0}, dots.dots.size(), [&](std::size_t i) {
    dots.dots[i].level = static_cast<float>(local_energy(dots.dots[i], dots.pitch_m, asked, density));
  });
  share_missing_energy(dots, asked, levels);
  double carried = 0;
  for (Dot& dot : dots.dots) {
    const double wanted = dot.level + carried, level = nearest_level(levels, wanted);
    carried = wanted - level;
    dot.level = static_cast<float>(level);
  }
}

}  // namespace hilbrush
