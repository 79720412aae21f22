#include "sim/film/fidelity.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_map>
#include <unordered_set>

#include "sampling/base/batches.h"
#include "sampling/base/random.h"
#include "sim/film/masked_image.h"
#include "sim/film/orthographic_view.h"
#include "sim/film/picture_means.h"

namespace hilbrush {

namespace {

constexpr std::size_t kSampleCount = 20'000;
constexpr std::array<double, 2> kSigmas{1, 2};  ///< of F1 and F2, in pitches
constexpr double kIdenticalDb = 99;             ///< stands for "no difference at all"

/// A surface point of the measurement, and what the film shows around it.
struct Reading {
  SurfacePoint point;
  bool is_reachable = false;
  std::array<PictureMeans, 2> means;  ///< of sigma 1 and 2 pitches
};

/// A hash: independent numbers for each (seed, index), whatever thread asks.
double uniform(std::uint64_t seed, std::uint64_t index) {
  return unit_interval(mix_bits(seed * kGoldenGamma + (index + 1) * 0xBF58476D1CE4E5B9u));
}

/// One point in each of kSampleCount strata of equal area, which follow the order of the triangles.
std::vector<Reading> stratified_points(const TexturedMesh& mesh, std::uint64_t seed) {
  std::vector<double> area_to(mesh.triangle_count());
  double area = 0;
  for (std::size_t t = 0; t < area_to.size(); ++t) area_to[t] = area += mesh.area_vector(t).norm();
  std::vector<Reading> readings(area > 0 ? kSampleCount : 0);
  for (std::size_t i = 0; i < readings.size(); ++i) {
    const double place = (static_cast<double>(i) + uniform(seed, 3 * i)) / kSampleCount * area;
    const auto t = std::min<std::size_t>(
        std::upper_bound(area_to.begin(), area_to.end(), place) - area_to.begin(), area_to.size() - 1);
    const double root = std::sqrt(uniform(seed, 3 * i + 1));
    const double v = uniform(seed, 3 * i + 2);
    readings[i].point = {static_cast<std::uint32_t>(t), {1 - root, root * (1 - v), root * v}};
  }
  return readings;
}

double decibels(double mean_square) {
  return mean_square > 0 ? std::min(kIdenticalDb, -10 * std::log10(mean_square)) : kIdenticalDb;
}

/// Everything but S2, over the readings that `counts` accepts.
template <class Counts>
FidelityFigures surface_figures(const std::vector<Reading>& readings, Counts counts) {
  std::array<double, 2> square{};
  std::array<double, 10> tenth_error{}, tenth_count{};
  std::vector<double> errors;
  for (const Reading& reading : readings) {
    if (!counts(reading)) continue;
    for (int k = 0; k < 2; ++k) square[k] += std::pow(reading.means[k].painted - reading.means[k].wanted, 2);
    const double error = reading.means[1].painted - reading.means[1].wanted;
    errors.push_back(std::abs(error));
    const int tenth = std::clamp(static_cast<int>(reading.means[1].wanted * 10), 0, 9);
    tenth_error[tenth] += error, tenth_count[tenth] += 1;
  }
  FidelityFigures figures;
  if (errors.empty()) return figures;
  const auto count = static_cast<double>(errors.size());
  figures.f1_db = decibels(square[0] / count), figures.f2_db = decibels(square[1] / count);
  // A tenth of which there is almost nothing has no mean tone to speak of.
  constexpr double kShareMin = .002;
  for (int i = 0; i < 10; ++i) {
    if (tenth_count[i] < kShareMin * count) continue;
    const double error = tenth_error[i] / tenth_count[i];
    figures.tone_rms += error * error * tenth_count[i] / count;
    figures.tone_max = std::max(figures.tone_max, std::abs(error));
  }
  figures.tone_rms = std::sqrt(figures.tone_rms);
  const auto rank = static_cast<std::size_t>(.999 * (count - 1));
  std::nth_element(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(rank), errors.end());
  figures.p999 = errors[rank];
  return figures;
}

/// Reachability everywhere, from the readings: that of the nearest one of a similar normal. Most places have
/// nothing unreachable near them, and are answered by one look.
class ReachMap {
 public:
  ReachMap(const TexturedMesh& mesh, const std::vector<Reading>& readings)
      : mesh_(mesh), readings_(readings) {
    cell_m_ = 2 * std::sqrt(mesh.area_m2() / static_cast<double>(std::max<std::size_t>(readings.size(), 1)));
    for (std::uint32_t i = 0; i < readings.size(); ++i) {
      const Eigen::Vector3i cell = cell_of(position(mesh, readings[i].point));
      cells_[key(cell)].push_back(i);
      if (!readings[i].is_reachable)
        for (int k = 0; k < 27; ++k) doubtful_.insert(key(cell + neighbor(k)));
    }
  }

  bool is_reachable(const SurfacePoint& point) const {
    const Eigen::Vector3d p_O = position(mesh_, point);
    const Eigen::Vector3i middle = cell_of(p_O);
    if (!doubtful_.contains(key(middle))) return true;
    const Eigen::Vector3d normal_O = face_normal(mesh_, point);
    double nearest = std::numeric_limits<double>::infinity();
    bool reachable = true;
    for (int k = 0; k < 27; ++k) {
      const auto found = cells_.find(key(middle + neighbor(k)));
      if (found == cells_.end()) continue;
      for (const std::uint32_t i : found->second) {
        const double distance = (position(mesh_, readings_[i].point) - p_O).squaredNorm();
        if (!(distance < nearest && face_normal(mesh_, readings_[i].point).dot(normal_O) > .5)) continue;
        nearest = distance;
        reachable = readings_[i].is_reachable;
      }
    }
    return reachable;
  }

 private:
  static Eigen::Vector3i neighbor(int k) { return {k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1}; }
  Eigen::Vector3i cell_of(const Eigen::Vector3d& p_O) const {
    return (p_O / cell_m_).array().floor().cast<int>();
  }
  static std::uint64_t key(const Eigen::Vector3i& cell) {
    std::uint64_t key = 0;
    for (int k = 0; k < 3; ++k) key = key << 21 | (static_cast<std::uint32_t>(cell[k]) & 0x1fffffu);
    return key;
  }

  const TexturedMesh& mesh_;
  const std::vector<Reading>& readings_;
  double cell_m_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
  std::unordered_set<std::uint64_t> doubtful_;  ///< cells with an unreachable reading in or beside them
};

/// The six directions of S2: along the axes, turned so that nothing drawn parallel to them falls in line with
/// the pixels.
std::array<ViewDirection, 6> measuring_views() {
  const Eigen::Matrix3d turn =
      (Eigen::AngleAxisd(.35, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(.21, Eigen::Vector3d::UnitX()))
          .matrix();
  std::array<ViewDirection, 6> views;
  for (int k = 0; k < 6; ++k) {
    const double sign = k % 2 == 0 ? 1 : -1;
    views[k] = {"", turn * sign * Eigen::Vector3d::Unit(k / 2),
                turn * Eigen::Vector3d::Unit((k / 2 + 1) % 3)};
  }
  return views;
}

/// Local SSIM of the two channels (Wang et al. 2004, window sigma 1.5 pixels) as a picture of one channel.
MaskedImage ssim(const MaskedImage& picture) {
  constexpr double kC1 = .01 * .01, kC2 = .03 * .03, kWindowSigma = 1.5;
  MaskedImage products(picture.width, picture.height, 5);
  products.weights = picture.weights;
  for (std::size_t i = 0; i < picture.weights.size(); ++i) {
    const float a = picture.channels[0][i];
    const float b = picture.channels[1][i];
    const std::array<float, 5> values{a, b, a * a, b * b, a * b};
    for (int k = 0; k < 5; ++k) products.channels[k][i] = values[k];
  }
  const MaskedImage means = masked_blur(products, kWindowSigma);
  MaskedImage similarity(picture.width, picture.height, 1);
  similarity.weights = means.weights;
  for (std::size_t i = 0; i < means.weights.size(); ++i) {
    const double a = means.channels[0][i];
    const double b = means.channels[1][i];
    const double variance_a = means.channels[2][i] - a * a;
    const double variance_b = means.channels[3][i] - b * b;
    const double covariance = means.channels[4][i] - a * b;
    similarity.channels[0][i] = static_cast<float>((2 * a * b + kC1) * (2 * covariance + kC2) /
                                                   ((a * a + b * b + kC1) * (variance_a + variance_b + kC2)));
  }
  return similarity;
}

/// S2 of the views added so far. What is reachable is decided for the pixels that are scored; the blur before
/// sees all film, so that the border of an unreachable place counts against the picture.
class ViewSimilarity {
 public:
  void add(const MaskedImage& picture, const OrthographicView& view, double pixels_a_pitch,
           const ReachMap& reach) {
    const int step = std::max(1, static_cast<int>(std::lround(pixels_a_pitch)));
    const MaskedImage similarity = ssim(masked_blur(picture, 2 * pixels_a_pitch, step));
    for (int y = 0; y < similarity.height; ++y)
      for (int x = 0; x < similarity.width; ++x) {
        const std::size_t i = similarity.index(x, y);
        if (!(similarity.weights[i] > 0)) continue;
        const double value = similarity.channels[0][i];
        whole_sum_ += value;
        whole_count_ += 1;
        const int view_x = std::min(x * step + step / 2, view.width() - 1);
        const int view_y = std::min(y * step + step / 2, view.height() - 1);
        if (!reach.is_reachable(view.pixel(view_x, view_y).point)) continue;
        reachable_sum_ += value;
        reachable_count_ += 1;
      }
  }
  double whole() const { return whole_count_ > 0 ? whole_sum_ / whole_count_ : 0; }
  double reachable() const { return reachable_count_ > 0 ? reachable_sum_ / reachable_count_ : 0; }

 private:
  double whole_sum_ = 0;
  double whole_count_ = 0;
  double reachable_sum_ = 0;
  double reachable_count_ = 0;
};

/// Fills wanted (channel 0) and painted (channel 1) coverage of what the view shows.
MaskedImage look(const Film& film, const ToneField& tone, const OrthographicView& view) {
  MaskedImage picture(view.width(), view.height(), 2);
  tbb::parallel_for(0, view.height(), [&](int y) {
    thread_local std::vector<OrthographicView::Pixel> pixels;
    view.read_row(y, pixels);
    for (int x = 0; x < view.width(); ++x) {
      if (pixels[x].side != OrthographicView::Side::kFront) continue;
      const std::size_t i = picture.index(x, y);
      picture.weights[i] = 1;
      picture.channels[0][i] = static_cast<float>(tone.wanted(pixels[x].point));
      picture.channels[1][i] = static_cast<float>(film.painted(pixels[x].point));
    }
  });
  return picture;
}

/// A third of a pitch; more for objects so large that a view would take more than some 24 million pixels.
double measuring_pixel_m(const Film& film) {
  constexpr double kMaxPixels = 24e6;
  const auto [low, high] = bounds(film.mesh());
  return std::max(film.pitch_m() / 3, (high - low).norm() / std::sqrt(kMaxPixels));
}

}  // namespace

Fidelity measure_fidelity(const Film& film, const ToneField& tone, const ReachTest& is_reachable,
                          std::uint64_t seed, const Progress& progress) {
  std::vector<Reading> readings = stratified_points(film.mesh(), seed);
  constexpr std::size_t kBatch = 2000;
  for_batches(readings.size(), kBatch, progress.part(0, .5), [&](std::size_t begin, std::size_t end) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(begin, end, 16),
                      [&](const tbb::blocked_range<std::size_t>& range) {
                        std::vector<FilmPoint> points;
                        for (std::size_t i = range.begin(); i < range.end(); ++i) {
                          read_means(film, &tone, readings[i].point, kSigmas, readings[i].means, points);
                          readings[i].is_reachable = !is_reachable || is_reachable(readings[i].point);
                        }
                      });
  });

  Fidelity fidelity;
  fidelity.whole = surface_figures(readings, [](const Reading&) { return true; });
  fidelity.reachable = surface_figures(readings, [](const Reading& reading) { return reading.is_reachable; });
  const auto unreachable = std::count_if(readings.begin(), readings.end(),
                                         [](const Reading& reading) { return !reading.is_reachable; });
  fidelity.unreachable_share =
      readings.empty() ? 0 : static_cast<double>(unreachable) / static_cast<double>(readings.size());

  const ReachMap reach(film.mesh(), readings);
  const double pixel_m = measuring_pixel_m(film);
  ViewSimilarity similarity;
  int seen = 0;
  for (const ViewDirection& direction : measuring_views()) {
    const OrthographicView view(film.mesh(), direction, pixel_m);
    similarity.add(look(film, tone, view), view, film.pitch_m() / pixel_m, reach);
    progress(.5 + .5 * ++seen / 6);
  }
  fidelity.whole.s2 = similarity.whole();
  fidelity.reachable.s2 = similarity.reachable();
  return fidelity;
}

}  // namespace hilbrush
