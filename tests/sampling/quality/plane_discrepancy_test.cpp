#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "sampling/quality/point_tree.h"
#include "sampling/quality/quality.h"
#include "tests/sampling/quality/point_sets.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d, Eigen::Vector3d;
using test::grid_points, test::random_directions, test::random_points;

constexpr TestShapes kManyShapes{40'000, 3};

/// One point in the middle: the shares of all shapes are 0 or 1, and the integrals over the shapes have
/// closed forms.
TEST(PlaneDiscrepancy, OfOnePointIsItsClosedForm) {
  const std::vector<Vector2d> middle{{.5, .5}};
  const Discrepancy rectangles = plane_discrepancy(middle, PlaneShape::kRectangle, kManyShapes);
  EXPECT_NEAR(rectangles.rms, std::sqrt(1. / 9 + .25 - 2 * 9. / 64), .003);
  EXPECT_NEAR(rectangles.largest, .75, .01);
  EXPECT_LE(rectangles.largest, .75);

  const double pi = std::numbers::pi, r = std::sqrt(.5);
  const Discrepancy circles = plane_discrepancy(middle, PlaneShape::kQuarterCircle, kManyShapes);
  EXPECT_NEAR(circles.rms, std::sqrt(pi * pi / 80 + (1 - r) - pi / 6 * (1 - r * r * r)), .003);
  EXPECT_NEAR(circles.largest, 1 - pi / 8, .001);

  // Triangles do not contain their own corner, so their error is their area.
  const Discrepancy triangles =
      plane_discrepancy(std::vector<Vector2d>{{0, 0}}, PlaneShape::kTriangle, kManyShapes);
  EXPECT_NEAR(triangles.rms, std::sqrt((2. / 9 - 1. / 8) / 4), .003);
  EXPECT_LE(triangles.largest, .5);
}

TEST(PlaneDiscrepancy, OfRandomPointsIsThatOfCoins) {
  constexpr std::size_t kCount = 2000;
  constexpr int kSets = 24;
  double squares = 0;
  for (unsigned seed = 1; seed <= kSets; ++seed) {
    const Discrepancy d = plane_discrepancy(random_points(kCount, seed), PlaneShape::kRectangle);
    squares += d.rms * d.rms / kSets;
  }
  EXPECT_NEAR(std::sqrt(squares * kCount), std::sqrt(1. / 4 - 1. / 9), .05);
}

TEST(PlaneDiscrepancy, OfAGridIsBoundedByItsStep) {
  for (const int side : {10, 100}) {
    const Discrepancy d = plane_discrepancy(grid_points(side), PlaneShape::kRectangle, kManyShapes);
    const double star = 1 - std::pow(1 - .5 / side, 2);
    EXPECT_LE(d.largest, star);
    EXPECT_GE(d.largest, .8 * star);
  }
}

TEST(PlaneDiscrepancy, AllThreeAreTheOnesAskedForOneByOne) {
  const auto points = random_points(500, 9);
  const auto all = plane_discrepancies(points);
  for (const PlaneShape shape : {PlaneShape::kRectangle, PlaneShape::kQuarterCircle, PlaneShape::kTriangle}) {
    const Discrepancy one = plane_discrepancy(points, shape);
    EXPECT_EQ(one.rms, all[static_cast<std::size_t>(shape)].rms);
    EXPECT_EQ(one.largest, all[static_cast<std::size_t>(shape)].largest);
  }
}

TEST(SphereDiscrepancy, OfRandomPointsFallsWithTheRoot) {
  // Eight triangles tile the sphere for every three corners, so the mean share is 1/8.
  double small = 0, large = 0;
  constexpr int kSets = 16;
  for (unsigned seed = 1; seed <= kSets; ++seed) {
    small += std::pow(sphere_discrepancy(random_directions(500, seed)).rms, 2) / kSets;
    large += std::pow(sphere_discrepancy(random_directions(2000, seed + 100)).rms, 2) / kSets;
  }
  EXPECT_NEAR(small / large, 4, .8);
  EXPECT_GT(small * 500, .08);
  EXPECT_LT(small * 500, 1. / 8);
}

TEST(SphereDiscrepancy, SharesAndAreasAgreeOnManyEvenPoints) {
  EXPECT_LT(sphere_discrepancy(test::spiral_directions(100'000)).largest, 5e-4);
}

TEST(Slope, OfAPowerLawIsItsExponent) {
  std::vector<double> counts, values;
  for (double n = 2; n < 1e6; n *= 1.5) {
    counts.push_back(n);
    values.push_back(7 * std::pow(n, -.73));
  }
  EXPECT_NEAR(log_log_slope(counts, values), -.73, 1e-12);
  values[3] = 0;  // left out
  EXPECT_NEAR(log_log_slope(counts, values), -.73, 1e-12);
  EXPECT_EQ(log_log_slope(std::vector<double>{5}, std::vector<double>{1}), 0);
  EXPECT_EQ(log_log_slope(std::vector<double>{5, 5}, std::vector<double>{1, 2}), 0);
}

/// Counts by the tree are the counts point by point, whatever the shape.
template <int kDimension, class Shape>
void expect_same_count(const PointTree<kDimension>& tree,
                       const std::vector<Eigen::Matrix<double, kDimension, 1>>& points, const Shape& shape) {
  std::size_t count = 0;
  for (const auto& point : points) count += shape.contains(point) ? 1 : 0;
  EXPECT_EQ(tree.count(shape), count);
}

TEST(PointTree, CountsEveryPointOnce) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const std::size_t n : {1u, 7u, 8u, 9u, 100u, 10'000u}) {
    auto flat = random_points(n, 1 + static_cast<unsigned>(n));
    for (std::size_t i = 0; i < n / 3; ++i) flat[i] = flat[n / 2];  // many equal points
    const auto space = random_directions(n, 2 + static_cast<unsigned>(n));
    const PointTree<2> tree2(flat);
    const PointTree<3> tree3(space);
    for (int i = 0; i < 50; ++i) {
      expect_same_count(tree2, flat, Ball<2>{{unit(random), unit(random)}, unit(random)});
      expect_same_count(tree3, space, Ball<3>{space[i % n], 2 * unit(random)});
      HalfSpaces<2, 3> corner;
      HalfSpaces<3, 3> cone;
      for (std::size_t k = 0; k < 3; ++k) {
        corner.normals[k] = Vector2d(unit(random) - .5, unit(random) - .5);
        corner.offsets[k] = .3 * (unit(random) - .5);
        cone.normals[k] = Vector3d(unit(random) - .5, unit(random) - .5, unit(random) - .5);
      }
      expect_same_count(tree2, flat, corner);
      expect_same_count(tree3, space, cone);
    }
  }
}

TEST(PointTree, FindsTheNearestThatIsAccepted) {
  const auto points = random_points(3000, 8);
  const PointTree<2> tree(points);
  for (const Vector2d& place : random_points(200, 9)) {
    std::uint32_t best = 1;
    for (std::uint32_t i = 1; i < points.size(); i += 2)
      if ((points[i] - place).norm() < (points[best] - place).norm()) best = i;
    const auto found = tree.nearest(place, [](std::uint32_t i) { return i % 2 == 1; });
    EXPECT_EQ(found.index, best);
    EXPECT_DOUBLE_EQ(found.distance, (points[best] - place).norm());
  }
  EXPECT_EQ(tree.nearest({.5, .5}, [](std::uint32_t) { return false; }).index, PointTree<2>::kNone);
}

}  // namespace
}  // namespace hilbrush
