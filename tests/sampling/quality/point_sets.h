#pragma once
#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <random>
#include <vector>

#include "sampling/dots/dots.h"
#include "sampling/model/textured_mesh.h"

/// Point sets whose figures are known.
namespace hilbrush::test {

inline std::vector<Eigen::Vector2d> random_points(std::size_t count, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<Eigen::Vector2d> points(count);
  for (auto& point : points) point = {unit(random), unit(random)};
  return points;
}

/// The middles of side * side squares, row by row, every second row backwards.
inline std::vector<Eigen::Vector2d> grid_points(int side) {
  std::vector<Eigen::Vector2d> points;
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i)
      points.emplace_back(((j % 2 == 0 ? i : side - 1 - i) + .5) / side, (j + .5) / side);
  return points;
}

/// One random point in each of side * side squares.
inline std::vector<Eigen::Vector2d> jittered_points(int side, unsigned seed) {
  auto points = grid_points(side);
  const auto shifts = random_points(points.size(), seed);
  for (std::size_t i = 0; i < points.size(); ++i) points[i] += (shifts[i] - Eigen::Vector2d(.5, .5)) / side;
  return points;
}

inline std::vector<Eigen::Vector3d> random_directions(std::size_t count, unsigned seed) {
  std::vector<Eigen::Vector3d> directions;
  for (const auto& p : random_points(count, seed)) {
    const double z = 2 * p.y() - 1, r = std::sqrt(1 - z * z), turn = 2 * std::numbers::pi * p.x();
    directions.emplace_back(r * std::cos(turn), r * std::sin(turn), z);
  }
  return directions;
}

/// Fibonacci's spiral: very even.
inline std::vector<Eigen::Vector3d> spiral_directions(std::size_t count) {
  std::vector<Eigen::Vector3d> directions;
  for (std::size_t i = 0; i < count; ++i) {
    const double z = (2 * static_cast<double>(i) + 1) / static_cast<double>(count) - 1,
                 r = std::sqrt(1 - z * z);
    const double turn = 2 * std::numbers::pi * static_cast<double>(i) / std::numbers::phi;
    directions.emplace_back(r * std::cos(turn), r * std::sin(turn), z);
  }
  return directions;
}

/// A dot on a mesh.
inline Dot dot_at(const TexturedMesh& mesh, const SurfacePoint& point) {
  Dot dot;
  dot.position_O = position(mesh, point);
  dot.normal_O = dot.smooth_normal_O = face_normal(mesh, point).cast<float>();
  dot.triangle = point.triangle;
  return dot;
}

/// Random dots on a mesh, by area.
inline std::vector<Dot> random_dots(const TexturedMesh& mesh, std::size_t count, unsigned seed) {
  std::mt19937_64 random(seed);
  std::vector<double> areas;
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t) areas.push_back(mesh.area_vector(t).norm());
  std::discrete_distribution<std::uint32_t> triangle(areas.begin(), areas.end());
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<Dot> dots;
  for (std::size_t i = 0; i < count; ++i) {
    const double root = std::sqrt(unit(random)), v = unit(random);
    dots.push_back(dot_at(mesh, {triangle(random), {1 - root, root * (1 - v), root * v}}));
  }
  return dots;
}

}  // namespace hilbrush::test
