#include "sim/film/calibrate.h"

#include <algorithm>
#include <cmath>

#include "sampling/base/input_error.h"
#include "sampling/tone/levels.h"
#include "sampling/tone/tone_field.h"
#include "sim/film/film.h"
#include "sim/film/picture_means.h"

namespace hilbrush {

namespace {

/// Sides of a field in pitches: neither square nor powers of two, where dots along a Hilbert curve fall into
/// exact grids that no object shows.
constexpr double kFieldWidth = 137, kFieldHeight = 91;
/// What is not read along the border, in pitches: light is lost over the edge.
constexpr double kFieldBorder = 4;

/// A flat black field, upright (laminar slices paint nothing that lies), whose tone curve then asks for
/// whatever coverage a step needs.
TexturedMesh black_field(double width_m, double height_m) {
  TexturedMesh field;
  field.vertices = {{0, 0, 0}, {width_m, 0, 0}, {width_m, 0, height_m}, {0, 0, height_m}};
  field.triangles = {{0, 1, 2}, {0, 2, 3}};
  field.corner_uv.resize(2, {Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()});
  field.corner_luminance.resize(2, {0.f, 0.f, 0.f});
  field.material_index = {0, 0};
  field.materials = {{.name = "black", .source = ColorSource::kColors}};
  return field;
}

/// Mean coverage of the field but for its border, by an even lattice of places a third of a pitch apart.
double read_field(const Film& film, double width_m, double height_m) {
  const double border_m = kFieldBorder * film.pitch_m();
  const double step_m = film.pitch_m() / 3;
  double sum = 0;
  long count = 0;
  for (double y = border_m; y <= height_m - border_m; y += step_m)
    for (double x = border_m; x <= width_m - border_m; x += step_m) {
      const double u = x / width_m;
      const double v = y / height_m;
      sum += u >= v ? film.painted({0, {1 - u, u - v, v}}) : film.painted({1, {1 - v, u, v - u}});
      ++count;
    }
  return sum / static_cast<double>(count);
}

double paint_step(const CellDescription& cell, double pitch_m, PictureOptions options,
                  const TexturedMesh& field, const SurfaceCurve& curve, double asked) {
  ToneOptions tone_options;
  tone_options.untextured = Untextured::kMaterial;
  tone_options.curve = {{0, 1}, {0, asked}};
  const ToneField tone(field, tone_options);
  options.sample.pitch_m = pitch_m;
  options.sample.dot_count.reset();
  options.predictive_rounds = 0;
  const DotSequence dots = place_picture(curve, tone, tone_options, options, {});
  Film film(field, cell, pitch_m);
  expose_dots(film, dots);
  return read_field(film, kFieldWidth * pitch_m, kFieldHeight * pitch_m);
}

/// Readings in rising order of what was asked; a reading that falls (by the grain of the dots) takes the mean
/// with its neighbors.
std::vector<WedgeStep> monotone(std::vector<WedgeStep> steps) {
  std::sort(steps.begin(), steps.end(),
            [](const WedgeStep& a, const WedgeStep& b) { return a.asked < b.asked; });
  // Pool adjacent violators: blocks of equal mean until the means rise.
  struct Block {
    double sum = 0;
    std::size_t count = 0;
    double mean() const { return sum / static_cast<double>(count); }
  };
  std::vector<Block> blocks;
  for (const WedgeStep& step : steps) {
    blocks.push_back({step.painted, 1});
    while (blocks.size() > 1 && blocks[blocks.size() - 2].mean() > blocks.back().mean()) {
      const Block last = blocks.back();
      blocks.pop_back();
      blocks.back().sum += last.sum, blocks.back().count += last.count;
    }
  }
  auto step = steps.begin();
  for (const Block& block : blocks)
    for (std::size_t i = 0; i < block.count; ++i) (step++)->painted = block.mean();
  return steps;
}

/// What to ask for so that `wanted` is read, by linear interpolation between the readings; at most asked_max.
double asked_for(const std::vector<WedgeStep>& steps, double wanted, double asked_max) {
  const auto above =
      std::find_if(steps.begin(), steps.end(), [&](const WedgeStep& step) { return step.painted >= wanted; });
  if (above == steps.end()) return asked_max;
  if (above == steps.begin()) return above->asked;
  const auto below = above - 1;
  const double share = (wanted - below->painted) / (above->painted - below->painted);
  return std::min(asked_max, below->asked + share * (above->asked - below->asked));
}

}  // namespace

Wedge wedge_on_film(const CellDescription& cell, double pitch_m, const PictureOptions& options) {
  return [&cell, pitch_m, options](const std::vector<double>& asked) {
    const TexturedMesh field = black_field(kFieldWidth * pitch_m, kFieldHeight * pitch_m);
    const SurfaceCurve curve(field,
                             options.curve == CurveKind::kLaminar ? CurveKind::kHilbert : options.curve);
    std::vector<WedgeStep> steps;
    for (const double coverage : asked)
      steps.push_back(
          {coverage, coverage > 0 ? paint_step(cell, pitch_m, options, field, curve, coverage) : 0.});
    return steps;
  };
}

std::vector<double> wedge_steps(std::vector<double> shares, double asked_max,
                                std::span<const double> levels) {
  for (double& share : shares) share *= asked_max;
  for (std::size_t k = 0; k + 1 < levels.size(); ++k) {
    const double last = kEnoughDots * levels[k];
    const auto nearest = std::min_element(shares.begin(), shares.end(), [&](double a, double b) {
      return std::abs(a - last) < std::abs(b - last);
    });
    if (nearest != shares.end()) *nearest = last;
  }
  return shares;
}

ToneCurve tone_curve_of(const std::vector<WedgeStep>& steps, double asked_max,
                        std::span<const double> levels) {
  constexpr std::size_t kStepsMin = 5;
  constexpr int kTones = 40;  // fine enough that the bends of the wedge's own steps are kept
  constexpr double kJump = 1e-4;
  if (steps.size() < kStepsMin)
    throw InputError("", "the wedge has " + std::to_string(steps.size()) + " steps; a curve needs at least " +
                             std::to_string(kStepsMin));
  std::vector<std::vector<WedgeStep>> of_level(levels.size());
  for (const WedgeStep& step : steps)
    if (step.asked > 0) of_level[level_for(levels, step.asked)].push_back(step);
  of_level.front().push_back({0, 0});
  std::erase_if(of_level, [](const auto& own) { return own.empty(); });
  for (auto& own : of_level) own = monotone(std::move(own));
  if (!(of_level.back().back().painted > 0))
    throw InputError("", "the wedge reads no paint at all, whatever was asked");

  ToneCurve curve;
  const auto add = [&](double wanted, double asked) {
    const double least = curve.asked.empty() ? 0 : curve.asked.back();
    curve.wanted.push_back(wanted);
    curve.asked.push_back(std::max(least, asked));
  };
  auto level = of_level.begin();
  for (int i = 0; i <= kTones; ++i) {
    const double wanted = static_cast<double>(i) / kTones;
    while (level + 1 != of_level.end() && wanted > level->back().painted) {
      const double taken_over = level->back().painted;
      if (curve.wanted.back() < taken_over) add(taken_over, level->back().asked);
      ++level;
      if (taken_over + kJump < wanted && curve.wanted.back() < taken_over + kJump)
        add(taken_over + kJump, asked_for(*level, taken_over, asked_max));
    }
    add(wanted, i == 0 ? 0 : asked_for(*level, wanted, asked_max));
  }
  return curve;
}

ToneCurve calibrate_tone(const Wedge& wedge, double asked_max) {
  constexpr int kWedgesMax = 6;
  constexpr double kTolerance = .003;
  const std::vector<double> wanted{0, .05, .1, .2, .3, .4, .5, .6, .7, .75, .8, .85, .9, .95, .98, 1};
  std::vector<double> asked;
  for (const double tone : wanted) asked.push_back(tone * asked_max);

  std::vector<WedgeStep> readings{{0, 0}};
  for (int round = 0; round < kWedgesMax; ++round) {
    const std::vector<WedgeStep> steps = wedge(asked);
    if (steps.size() != asked.size())
      throw InputError("", "the wedge has " + std::to_string(steps.size()) + " readings, not one a step");
    double worst = 0;
    for (std::size_t i = 1; i < steps.size(); ++i) {
      const bool is_at_limit = steps[i].painted < wanted[i] && asked[i] >= asked_max;
      if (!is_at_limit) worst = std::max(worst, std::abs(steps[i].painted - wanted[i]));
    }
    if (round > 0 && worst <= kTolerance) break;
    readings.insert(readings.end(), steps.begin() + 1, steps.end());
    readings = monotone(readings);
    if (!(readings.back().painted > 0))
      throw InputError("", "the wedge reads no paint at all, whatever was asked");
    for (std::size_t i = 1; i < wanted.size(); ++i)
      asked[i] = std::max(asked[i - 1], asked_for(readings, wanted[i], asked_max));
  }
  asked.back() = std::max(asked.back(), asked[asked.size() - 2]);
  return {wanted, asked};
}

}  // namespace hilbrush
