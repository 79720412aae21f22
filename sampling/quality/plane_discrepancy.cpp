#include <Eigen/LU>
#include <numbers>

#include "sampling/base/check.h"
#include "sampling/quality/point_tree.h"
#include "sampling/quality/quality.h"
#include "sampling/quality/test_shapes.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d, Eigen::Vector3d;

template <class Tree, class Shape>
double error_of(const Tree& tree, const Shape& shape, double share) {
  return static_cast<double>(tree.count(shape)) / static_cast<double>(tree.size()) - share;
}

double rectangle_error(const PointTree<2>& tree, const ShapeNumbers& number) {
  const Vector2d corner(number(0), number(1));
  const HalfSpaces<2, 2> rectangle{{Vector2d(-1, 0), Vector2d(0, -1)}, {-corner.x(), -corner.y()}};
  return error_of(tree, rectangle, corner.prod());
}

double quarter_circle_error(const PointTree<2>& tree, const ShapeNumbers& number) {
  const double radius = 1 - number(0);
  const auto corner = static_cast<int>(4 * number(1));
  const Ball<2> circle{Vector2d(corner & 1, corner >> 1), radius};
  return error_of(tree, circle, std::numbers::pi / 4 * radius * radius);
}

double triangle_error(const PointTree<2>& tree, const ShapeNumbers& number) {
  Vector2d a(number(0), number(1)), b(number(2), number(3));
  double cross = a.x() * b.y() - a.y() * b.x();
  if (cross < 0) {
    std::swap(a, b);
    cross = -cross;
  }
  const Vector2d ab = b - a;
  const Vector2d inward(-ab.y(), ab.x());
  const HalfSpaces<2, 3> triangle{{Vector2d(-a.y(), a.x()), Vector2d(b.y(), -b.x()), inward},
                                  {0, 0, inward.dot(a)}};
  return error_of(tree, triangle, cross / 2);
}

double plane_error(const PointTree<2>& tree, PlaneShape shape, const ShapeNumbers& number) {
  switch (shape) {
    case PlaneShape::kRectangle:
      return rectangle_error(tree, number);
    case PlaneShape::kQuarterCircle:
      return quarter_circle_error(tree, number);
    case PlaneShape::kTriangle:
      return triangle_error(tree, number);
  }
  check_failed(__FILE__, __LINE__, "no such shape");
}

Discrepancy measure_plane(const PointTree<2>& tree, PlaneShape shape, const TestShapes& shapes) {
  return measure_shapes(shapes.count, [&](std::size_t i) {
    return plane_error(tree, shape, ShapeNumbers(shapes, static_cast<std::uint64_t>(shape), i));
  });
}

/// On the unit sphere, uniform: equation 5.3.
Vector3d random_direction(double u, double v) {
  const double z = 2 * v - 1;
  const double r = std::sqrt(std::max(0., 1 - z * z));
  const double turn = 2 * std::numbers::pi * u;
  return {r * std::cos(turn), r * std::sin(turn), z};
}

double spherical_triangle_error(const PointTree<3>& tree, const ShapeNumbers& number) {
  const Vector3d a = random_direction(number(0), number(1));
  Vector3d b = random_direction(number(2), number(3));
  Vector3d c = random_direction(number(4), number(5));
  double volume = a.dot(b.cross(c));
  if (volume < 0) {
    std::swap(b, c);
    volume = -volume;
  }
  const double area = 2 * std::atan2(volume, 1 + a.dot(b) + b.dot(c) + c.dot(a));
  const HalfSpaces<3, 3> triangle{{a.cross(b), b.cross(c), c.cross(a)}, {}};
  return error_of(tree, triangle, area / (4 * std::numbers::pi));
}

}  // namespace

Discrepancy plane_discrepancy(std::span<const Vector2d> points, PlaneShape shape, const TestShapes& shapes) {
  CHECK(!points.empty());
  return measure_plane(PointTree<2>(points), shape, shapes);
}

std::array<Discrepancy, 3> plane_discrepancies(std::span<const Vector2d> points, const TestShapes& shapes) {
  CHECK(!points.empty());
  const PointTree<2> tree(points);
  std::array<Discrepancy, 3> result;
  for (const PlaneShape shape : {PlaneShape::kRectangle, PlaneShape::kQuarterCircle, PlaneShape::kTriangle})
    result[static_cast<std::size_t>(shape)] = measure_plane(tree, shape, shapes);
  return result;
}

Discrepancy sphere_discrepancy(std::span<const Vector3d> directions, const TestShapes& shapes) {
  CHECK(!directions.empty());
  const PointTree<3> tree(directions);
  return measure_shapes(shapes.count, [&](std::size_t i) {
    return spherical_triangle_error(tree, ShapeNumbers(shapes, 3, i));
  });
}

double log_log_slope(std::span<const double> counts, std::span<const double> values) {
  CHECK_EQ(counts.size(), values.size());
  double n = 0;
  double sx = 0;
  double sy = 0;
  double sxx = 0;
  double sxy = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (!(counts[i] > 0) || !(values[i] > 0)) continue;
    const double x = std::log(counts[i]);
    const double y = std::log(values[i]);
    n += 1;
    sx += x;
    sy += y;
    sxx += x * x;
    sxy += x * y;
  }
  const double variance = n * sxx - sx * sx;
  return n < 2 || !(variance > 1e-12 * n * sxx) ? 0 : (n * sxy - sx * sy) / variance;
}

}  // namespace hilbrush
