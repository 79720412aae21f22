#include "daemon/pipeline/quality/plots.h"

#include <algorithm>
#include <cmath>

#include "sampling/base/angles.h"
#include "sampling/quality/plot.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d, Eigen::Vector3d;

constexpr std::size_t kMaxShown = 30'000;  ///< dots in a picture: with more it is black and its file large

Plot discrepancy_plot(const std::string& title, const std::vector<SizedFigures>& sizes) {
  Plot plot{"Discrepancy: " + title, "dots", "rms error of the test shapes' shares", true, true, {}, {}, {}};
  for (const auto& [shapes, unused] : sizes.front().discrepancy) {
    PlotSeries series{shapes, {}, PlotSeries::Style::kLine};
    for (const SizedFigures& figures : sizes)
      series.points.emplace_back(static_cast<double>(figures.count), figures.discrepancy.at(shapes).rms);
    plot.series.push_back(std::move(series));
  }
  return plot;
}

Plot spectrum_plot(const std::string& title, const Spectrum& spectrum) {
  Plot plot{"Radially averaged power spectrum: " + title,
            "frequency over the principal frequency sqrt(N / A)",
            "power (1: white noise)",
            false,
            false,
            0.,
            std::clamp(1.1 * spectrum.peak, 1.5, 8.),
            {}};
  PlotSeries series;
  for (const Spectrum::Ring& ring : spectrum.rings) series.points.emplace_back(ring.frequency, ring.power);
  plot.series.push_back(std::move(series));
  return plot;
}

Plot direction_plot(const std::string& title, const Spectrum& spectrum) {
  Plot plot{"Power by direction at the principal frequency: " + title,
            "degrees from +x",
            "power",
            false,
            false,
            0.,
            {},
            {}};
  PlotSeries series;
  const double step = 180 / static_cast<double>(spectrum.directions.size());
  for (std::size_t i = 0; i < spectrum.directions.size(); ++i)
    series.points.emplace_back((static_cast<double>(i) + .5) * step, spectrum.directions[i]);
  plot.series.push_back(std::move(series));
  return plot;
}

Plot anisotropy_plot(const std::string& title, const Spectrum& spectrum) {
  Plot plot{"Anisotropy: " + title,
            "frequency over the principal frequency sqrt(N / A)",
            "variance over squared mean, dB (0: white noise)",
            false,
            false,
            {},
            {},
            {}};
  PlotSeries series;
  for (const Spectrum::Ring& ring : spectrum.rings)
    if (ring.anisotropy > 0) series.points.emplace_back(ring.frequency, 10 * std::log10(ring.anisotropy));
  plot.series.push_back(std::move(series));
  return plot;
}

Plot neighbor_plot(const std::string& title, const Spacing& spacing) {
  constexpr std::size_t kBars = 60;
  const double step = 1.2 / kBars;
  std::vector<double> shares(kBars, 0.);
  for (const double distance : spacing.distances)
    if (const auto bar = static_cast<std::size_t>(distance / step); bar < kBars)
      shares[bar] += 1 / static_cast<double>(spacing.distances.size());
  Plot plot{"Nearest neighbors: " + title,
            "distance over that of the densest packing",
            "share of the dots",
            false,
            false,
            0.,
            {},
            {}};
  PlotSeries series{"", {}, PlotSeries::Style::kBars};
  for (std::size_t i = 0; i < kBars; ++i)
    series.points.emplace_back((static_cast<double>(i) + .5) * step, shares[i]);
  plot.series.push_back(std::move(series));
  return plot;
}

/// The square as it is; a surface seen from the side, without the dots on its back.
PointPicture picture_of(const MeasuredDots& dots) {
  constexpr double kTurn_deg = 30;
  constexpr double kHeight_deg = 25;
  PointPicture picture;
  if (!dots.plane_points.empty()) {
    picture.points = dots.plane_points;
  } else {
    const double turn = kTurn_deg * kDegree;
    const double height = kHeight_deg * kDegree;
    const Vector3d eye(std::cos(height) * std::cos(turn), std::cos(height) * std::sin(turn),
                       std::sin(height));
    for (const Dot& dot : dots.dots)
      if (dot.normal_O.isZero() || dot.normal_O.cast<double>().dot(eye) > 0)
        picture.points.push_back(project(dot.position_O, kTurn_deg, kHeight_deg));
  }
  Vector2d low = picture.points.empty() ? Vector2d::Zero() : picture.points.front();
  Vector2d high = low;
  for (const Vector2d& p : picture.points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const Vector2d extent = high - low;
  picture.radius = .25 * std::sqrt(std::max(extent.prod(), 1e-300) /
                                   static_cast<double>(std::max<std::size_t>(picture.points.size(), 1)));
  return picture;
}

}  // namespace

std::vector<std::string> write_plots(const std::string& title, const std::vector<SizedFigures>& sizes,
                                     const MeasuredDots& last, const std::filesystem::path& output) {
  std::vector<std::string> files;
  const auto write = [&](const char* name, const std::string& svg) {
    write_svg(svg, output / name);
    files.emplace_back(name);
  };
  const SizedFigures& figures = sizes.back();
  const std::string with_count = title + ", " + std::to_string(figures.count) + " dots";
  if (sizes.size() > 1 && !figures.discrepancy.empty())
    write("discrepancy.svg", svg_of(discrepancy_plot(title, sizes)));
  if (figures.spectrum) write("spectrum.svg", svg_of(spectrum_plot(with_count, *figures.spectrum)));
  if (figures.spectrum && !figures.spectrum->directions.empty()) {
    write("directions.svg", svg_of(direction_plot(with_count, *figures.spectrum)));
    write("anisotropy.svg", svg_of(anisotropy_plot(with_count, *figures.spectrum)));
  }
  if (figures.spacing && !figures.spacing->distances.empty())
    write("neighbors.svg", svg_of(neighbor_plot(with_count, *figures.spacing)));
  if (figures.count <= kMaxShown) {
    const PointPicture picture = picture_of(last);
    write("dots.svg", svg_of(std::span(&picture, 1), with_count));
  }
  return files;
}

std::string write_coherence(PlaneCurve curve, const Coherence& coherence,
                            const std::filesystem::path& output) {
  const std::string name = plane_curve_name(curve);
  Plot plot{"Spatial coherence of " + name,
            "straight distance",
            "share of the curve between",
            false,
            false,
            0.,
            1.,
            {{"", coherence.pairs, PlotSeries::Style::kMarks}}};
  const std::string file = "coherence_" + name + ".svg";
  write_svg(svg_of(plot), output / file);
  return file;
}

}  // namespace hilbrush
