#include "sampling/quality/spacing.h"

#include <tbb/parallel_for.h>

#include <numbers>

#include "sampling/base/check.h"
#include "sampling/quality/point_tree.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d, Eigen::Vector3d;

constexpr double kSphereArea = 4 * std::numbers::pi;

template <int kDimension>
Spacing spacing_of(std::span<const Eigen::Matrix<double, kDimension, 1>> points, double area) {
  const PointTree<kDimension> tree(points);
  const double densest = densest_packing_distance(area / static_cast<double>(points.size()));
  std::vector<double> distances(points.size());
  tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t i) {
    distances[i] =
        tree.nearest(points[i], [i](std::uint32_t other) { return other != i; }).distance / densest;
  });
  return spacing_figures(std::move(distances));
}

template <int kDimension>
double path_length(std::span<const Eigen::Matrix<double, kDimension, 1>> points) {
  double sum = 0;
  for (std::size_t i = 1; i < points.size(); ++i) sum += (points[i] - points[i - 1]).norm();
  return sum;
}

}  // namespace

double densest_packing_distance(double area_each) {
  return std::sqrt(2 * area_each / std::numbers::sqrt3);
}

Spacing spacing_figures(std::vector<double> distances) {
  std::erase_if(distances, [](double distance) { return !std::isfinite(distance); });
  std::sort(distances.begin(), distances.end());
  Spacing result;
  if (distances.empty()) return result;
  const auto n = static_cast<double>(distances.size());
  double sum = 0;
  double squares = 0;
  for (const double distance : distances) sum += distance;
  result.smallest = distances.front();
  result.mean = sum / n;
  for (const double distance : distances) squares += (distance - result.mean) * (distance - result.mean);
  result.spread = result.mean > 0 ? std::sqrt(squares / n) / result.mean : 0;
  result.distances = std::move(distances);
  return result;
}

Spacing plane_spacing(std::span<const Vector2d> points) {
  return spacing_of<2>(points, 1);
}
Spacing sphere_spacing(std::span<const Vector3d> directions) {
  return spacing_of<3>(directions, kSphereArea);
}

double path_constant(std::span<const Vector2d> points, double area) {
  CHECK(!points.empty() && area > 0);
  return path_length<2>(points) / std::sqrt(static_cast<double>(points.size()) * area);
}
double path_constant(std::span<const Vector3d> points, double area) {
  CHECK(!points.empty() && area > 0);
  return path_length<3>(points) / std::sqrt(static_cast<double>(points.size()) * area);
}

}  // namespace hilbrush
