#include "sim/film/picture_means.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "sampling/base/check.h"

namespace hilbrush {
namespace {

constexpr double kCutSigmas = 3;
constexpr std::array<double, 1> kPredictionSigmas{1};

std::vector<float> means_at(const Film& film, const ToneField* tone, std::span<const SurfacePoint> places,
                            double PictureMeans::*which) {
  std::vector<float> values(places.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, places.size(), 256),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      std::vector<FilmPoint> points;
                      for (std::size_t i = range.begin(); i < range.end(); ++i) {
                        std::array<PictureMeans, 1> means;
                        read_means(film, tone, places[i], kPredictionSigmas, means, points);
                        values[i] = static_cast<float>(means[0].*which);
                      }
                    });
  return values;
}

}  // namespace

void read_means(const Film& film, const ToneField* tone, const SurfacePoint& center,
                std::span<const double> sigmas, std::span<PictureMeans> means,
                std::vector<FilmPoint>& points) {
  CHECK_EQ(sigmas.size(), means.size());
  CHECK_LE(sigmas.size(), std::size_t{4});
  std::array<double, 4> weights{};
  std::fill(means.begin(), means.end(), PictureMeans{});
  const Eigen::Vector3d center_O = position(film.mesh(), center);
  const Eigen::Vector3d normal_O = face_normal(film.mesh(), center);
  film.points_near(center, kCutSigmas * *std::max_element(sigmas.begin(), sigmas.end()) * film.pitch_m(),
                   points);
  for (const FilmPoint& point : points) {
    const Eigen::Vector3d offset = (point.position_O - center_O) / film.pitch_m();
    const double depth = offset.dot(normal_O);
    const double r2 = offset.squaredNorm() - depth * depth;
    const double wanted = tone ? tone->wanted(point.point) : 0;
    const double painted = film.painted(point.dose_j_m2);
    for (std::size_t k = 0; k < sigmas.size(); ++k) {
      const double reach = kCutSigmas * sigmas[k];
      if (r2 > reach * reach || std::abs(depth) > reach) continue;
      const double weight = point.area_m2 * std::exp(-r2 / (2 * sigmas[k] * sigmas[k]));
      weights[k] += weight, means[k].wanted += weight * wanted, means[k].painted += weight * painted;
    }
  }
  for (std::size_t k = 0; k < sigmas.size(); ++k) {
    if (weights[k] > 0)
      means[k] = {means[k].wanted / weights[k], means[k].painted / weights[k]};
    else
      means[k] = {tone ? tone->wanted(center) : 0, film.painted(center)};
  }
}

void expose_dots(Film& film, const DotSequence& dots) {
  std::vector<SurfacePoint> points;
  std::vector<float> levels;
  points.reserve(dots.dots.size()), levels.reserve(dots.dots.size());
  for (const Dot& dot : dots.dots) {
    points.push_back(foot_of_perpendicular(film.mesh(), dot.triangle, dot.position_O));
    levels.push_back(dot.level);
  }
  film.expose_at(points, levels);
}

PicturePredictor film_predictor(const CellDescription& cell, const ToneField& tone) {
  PicturePredictor predictor;
  predictor.wanted = [&cell, &tone](double pitch_m, std::span<const SurfacePoint> places) {
    return means_at(Film(tone.mesh(), cell, pitch_m), &tone, places, &PictureMeans::wanted);
  };
  predictor.painted = [&cell, &tone](const DotSequence& dots, std::span<const SurfacePoint> places) {
    Film film(tone.mesh(), cell, dots.pitch_m);
    expose_dots(film, dots);
    return means_at(film, nullptr, places, &PictureMeans::painted);
  };
  return predictor;
}

}  // namespace hilbrush
