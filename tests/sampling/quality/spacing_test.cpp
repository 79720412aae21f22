#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "sampling/quality/quality.h"
#include "tests/sampling/quality/point_sets.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d, Eigen::Vector3d;

const double kGridSpacing =
    1 / std::sqrt(2 / std::numbers::sqrt3);  ///< of a square grid over the densest packing

TEST(PlaneSpacing, OfAGridIsTheSameEverywhere) {
  const Spacing spacing = plane_spacing(test::grid_points(40));
  EXPECT_NEAR(spacing.smallest, kGridSpacing, 1e-9);
  EXPECT_NEAR(spacing.mean, kGridSpacing, 1e-9);
  EXPECT_NEAR(spacing.spread, 0, 1e-6);
  EXPECT_EQ(spacing.distances.size(), 1600u);
}

TEST(PlaneSpacing, OfRandomPointsHasTheKnownMean) {
  // Mean nearest distance of a Poisson process is 1 / (2 sqrt(density)), its spread sqrt(4 / pi - 1).
  const Spacing spacing = plane_spacing(test::random_points(40'000, 3));
  EXPECT_NEAR(spacing.mean, .5 * kGridSpacing, .01);
  EXPECT_NEAR(spacing.spread, std::sqrt(4 / std::numbers::pi - 1), .01);
  EXPECT_LT(spacing.smallest, .02);
  EXPECT_TRUE(std::is_sorted(spacing.distances.begin(), spacing.distances.end()));
}

TEST(PlaneSpacing, OfOnePointIsNothing) {
  const Spacing spacing = plane_spacing(std::vector<Vector2d>{{.5, .5}});
  EXPECT_EQ(spacing.smallest, 0);
  EXPECT_TRUE(spacing.distances.empty());
}

TEST(PlaneHole, OfSimpleSetsIsItsClosedForm) {
  EXPECT_NEAR(plane_largest_hole(test::grid_points(37)), std::sqrt(.5), 1e-3);
  EXPECT_NEAR(plane_largest_hole(std::vector<Vector2d>{{.25, .25}}), .75 * std::numbers::sqrt2, 1e-3);
  EXPECT_NEAR(plane_largest_hole(std::vector<Vector2d>{{0, 0}, {1, 1}}), std::numbers::sqrt2, 2e-3);
}

TEST(PlaneHole, IsAsLargeAsAnyEmptyDisc) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const auto points = test::random_points(500, seed);
    double best = 0;  // brute force on a fine grid
    for (int j = 0; j <= 100; ++j)
      for (int i = 0; i <= 100; ++i) {
        double nearest = 2;
        for (const Vector2d& p : points)
          nearest = std::min(nearest, (p - Vector2d(i, j) / 100.).squaredNorm());
        best = std::max(best, std::sqrt(nearest));
      }
    const double hole = plane_largest_hole(points) / std::sqrt(500.);
    EXPECT_GE(hole, .999 * best) << "seed " << seed;
    EXPECT_LE(hole, best + .0071) << "seed " << seed;
  }
}

TEST(SphereSpacing, OfAnOctahedronIsItsClosedForm) {
  const std::vector<Vector3d> corners{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  const double area_each = 4 * std::numbers::pi / 6;
  EXPECT_NEAR(sphere_spacing(corners).smallest,
              std::numbers::sqrt2 / std::sqrt(2 * area_each / std::numbers::sqrt3), 1e-9);
  EXPECT_NEAR(sphere_largest_hole(corners), std::sqrt(2 - 2 / std::numbers::sqrt3) / std::sqrt(area_each),
              1e-3);
}

TEST(PathConstant, OfRowsIsOne) {
  EXPECT_NEAR(path_constant(test::grid_points(50)), 49. / 50 + 49. / 2500, 1e-9);
}

TEST(Coherence, HilbertAndPeanoKeepTheirHoelderConstants) {
  // Known least upper bounds: 6 for Hilbert's curve, 8 for Peano's.
  const Coherence hilbert = spatial_coherence(PlaneCurve::kHilbert, 12);
  EXPECT_LE(hilbert.hoelder, 6);
  EXPECT_GE(hilbert.hoelder, 5);
  const Coherence peano = spatial_coherence(PlaneCurve::kPeano2, 9);
  EXPECT_LE(peano.hoelder, 8);
  EXPECT_GE(peano.hoelder, 6.5);
  const Coherence z = spatial_coherence(PlaneCurve::kZ, 12), rows = spatial_coherence(PlaneCurve::kRows, 12);
  EXPECT_GT(z.hoelder, 100);
  EXPECT_GT(rows.hoelder, 100);
}

/// Along rows the share of the curve is the distance across them: both distances of random pairs are known.
TEST(Coherence, OfRowsIsThatOfTheirDistance) {
  const auto a = test::random_points(20'000, 1), b = test::random_points(20'000, 2);
  double n = 0, x = 0, y = 0, xx = 0, yy = 0, xy = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double straight = (a[i] - b[i]).norm(), along = std::abs(a[i].y() - b[i].y());
    n += 1;
    x += straight;
    y += along;
    xx += straight * straight;
    yy += along * along;
    xy += straight * along;
  }
  const double expected =
      (xy / n - x * y / n / n) / std::sqrt((xx / n - x * x / n / n) * (yy / n - y * y / n / n));
  const Coherence rows = spatial_coherence(PlaneCurve::kRows, 12, {20'000, 2});
  EXPECT_NEAR(rows.correlation, expected, .02);
  EXPECT_EQ(rows.pairs.size(), 20'000u);
}

TEST(Coherence, NeighborsOnACurveAreNeighborsInTheSquare) {
  for (const PlaneCurve curve : {PlaneCurve::kHilbert, PlaneCurve::kPeano2, PlaneCurve::kRows}) {
    // Depth 1 of Peano: nine places in a row of steps; any pair k apart is at most k steps away.
    const int depth = 3;
    const double side = curve == PlaneCurve::kPeano2 ? 27 : 8;
    for (const Vector2d& pair : spatial_coherence(curve, depth, {2000, 1}).pairs)
      EXPECT_LE(pair.x() * side, pair.y() * side * side + 1e-9) << plane_curve_name(curve);
  }
}

}  // namespace
}  // namespace hilbrush
