#include "sampling/parametric/density.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace hilbrush {
namespace {

/// Places of the grid along each side of the domain.
constexpr int kGrid = 256;
/// Curvature is clipped at the value that this share of the area is below (ParametricDensity).
constexpr double kUnclippedShare = .995;

bool is_curvature(ParametricDensity density) {
  return density == ParametricDensity::kMeanCurvature || density == ParametricDensity::kGaussianCurvature;
}

/// The value below which `share` of the total weight lies.
double weighted_quantile(std::vector<std::pair<double, double>> values_and_weights, double share) {
  std::sort(values_and_weights.begin(), values_and_weights.end());
  double total = 0;
  double passed = 0;
  for (const auto& [value, weight] : values_and_weights) total += weight;
  for (const auto& [value, weight] : values_and_weights) {
    passed += weight;
    if (passed >= share * total) return value;
  }
  return 0;
}

}  // namespace

DensityOnSurface::DensityOnSurface(const ParametricSurface& surface, ParametricDensity density)
    : surface_(surface), density_(density), largest_(std::numeric_limits<double>::max()) {
  std::vector<std::pair<double, double>> densities_and_areas;
  for (int j = 0; j < kGrid; ++j)
    for (int i = 0; i < kGrid; ++i) {
      const Eigen::Vector2d uv((i + .5) / kGrid, (j + .5) / kGrid);
      const double area = surface.area_element(uv) / (kGrid * kGrid);
      if (std::isfinite(area)) densities_and_areas.emplace_back(unclipped(uv), area);
    }
  if (is_curvature(density)) largest_ = weighted_quantile(densities_and_areas, kUnclippedShare);
  double mass = 0;
  for (const auto& [value, area] : densities_and_areas) {
    area_ += area;
    mass += area * std::min(value, largest_);
  }
  if (area_ > 0) mean_ = mass / area_;
}

double DensityOnSurface::unclipped(const Eigen::Vector2d& uv) const {
  const auto finite = [](double curvature) {
    return std::isfinite(curvature) ? std::abs(curvature) : std::numeric_limits<double>::max();
  };
  switch (density_) {
    case ParametricDensity::kConstant:
      return 1;
    case ParametricDensity::kU:
      return uv.x();
    case ParametricDensity::kUPlusV:
      return uv.sum();
    case ParametricDensity::kMeanCurvature:
      return finite(surface_.mean_curvature(uv));
    case ParametricDensity::kGaussianCurvature:
      return finite(surface_.gaussian_curvature(uv));
  }
  return 0;
}

double DensityOnSurface::at(const Eigen::Vector2d& uv) const {
  return std::min(unclipped(uv), largest_);
}

}  // namespace hilbrush
