#include "sampling/quality/surface_quality.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <numbers>

#include "sampling/base/input_error.h"
#include "sampling/model/nearest_in_triangle.h"
#include "sampling/place_dots.h"
#include "sampling/quality/quality.h"
#include "tests/sampling/quality/point_sets.h"
#include "tests/support/meshes.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d, Eigen::Vector3d;
using Sets = std::vector<std::span<const Dot>>;

using test::kPi;

TEST(DiscTriangleArea, HasItsClosedForms) {
  const Vector2d a(-1, -1), b(3, -1), c(-1, 3);
  EXPECT_NEAR(disc_triangle_area(.5, a, b, c), kPi / 4, 1e-12);                // the disc is inside
  EXPECT_NEAR(disc_triangle_area(10, a, b, c), 8, 1e-12);                      // the triangle is
  EXPECT_NEAR(disc_triangle_area(1, {0, 0}, {9, 0}, {0, 9}), kPi / 4, 1e-12);  // a quarter
  EXPECT_NEAR(disc_triangle_area(1, {5, 5}, {6, 5}, {5, 6}), 0, 1e-12);        // apart
  EXPECT_NEAR(disc_triangle_area(1, {-9, 0}, {9, 0}, {0, 9}), kPi / 2, 1e-12);
  EXPECT_NEAR(disc_triangle_area(1, {-9, .5}, {9, .5}, {0, 9}), kPi / 3 - std::sqrt(3) / 4, 1e-9);  // a cap
}

TEST(DiscTriangleArea, OfTwoHalvesIsThatOfTheWhole) {
  for (unsigned seed = 1; seed <= 200; ++seed) {
    auto p = test::random_points(4, seed);
    for (Vector2d& v : p) v = 3 * (v - Vector2d(.5, .5));
    const double radius = p[3].norm(), t = .3;
    const Vector2d middle = (1 - t) * p[1] + t * p[2];
    EXPECT_NEAR(
        disc_triangle_area(radius, p[0], p[1], p[2]),
        disc_triangle_area(radius, p[0], p[1], middle) + disc_triangle_area(radius, p[0], middle, p[2]),
        1e-12)
        << "seed " << seed;
  }
}

TEST(SurfaceQuality, ABallOnASphereCutsPiRSquared) {
  // Archimedes: a ball around a point of a sphere cuts out of it the area of a flat disc with that radius.
  const double r = .025;
  const TexturedMesh mesh = test::sphere(r, 400, 200);
  const SurfaceQuality quality(mesh);
  for (const double radius : {.001, .01, .03, .049}) {
    const double expected = radius * radius / (4 * r * r);
    EXPECT_NEAR(quality.share_in_ball({r, 0, 0}, radius), expected, 1e-3 * expected + 1e-5) << radius;
    EXPECT_NEAR(quality.share_in_ball({0, 0, r}, radius), expected, 1e-3 * expected + 1e-5) << radius;
  }
  EXPECT_NEAR(quality.share_in_ball({r, 0, 0}, .051), 1, 1e-12);
}

TEST(SurfaceQuality, ABallOnAPlateIsExact) {
  const TexturedMesh mesh = test::rectangle(.05, .05, 13, 7);
  const SurfaceQuality quality(mesh);
  EXPECT_NEAR(quality.share_in_ball({.025, .02, 0}, .015), kPi * .015 * .015 / .0025, 1e-12);
  EXPECT_NEAR(quality.share_in_ball({.025, .02, .009}, .015), kPi * .012 * .012 / .0025, 1e-12);
  EXPECT_NEAR(quality.share_in_ball({0, .02, 0}, .015), kPi * .015 * .015 / .005,
              1e-12);  // half beyond the border
}

TEST(SurfaceQuality, AToneIsCountedByItsMass) {
  // Black to the left of the middle, white to the right, two texels apart in between.
  const TexturedMesh mesh = test::with_texture(
      test::rectangle(.05, .05, 3, 4), 64, 64, [](int i, int) { return i < 32 ? 0. : 1.; }, false, false);
  const ToneField tone(mesh, {});
  const SurfaceQuality quality(mesh, &tone);
  EXPECT_NEAR(quality.mass_m2(), .00125, 1e-5);
  EXPECT_NEAR(quality.share_in_ball({.0125, .025, 0}, .01), kPi * 1e-4 / .00125, 2e-3);
  EXPECT_NEAR(quality.share_in_ball({.025, .025, 0}, .01), kPi * .5e-4 / .00125, 2e-3);
  EXPECT_NEAR(quality.share_in_ball({.0375, .025, 0}, .01), 0, 1e-12);
}

TEST(SurfaceQuality, TriangleSetsSeeNoErrorWhereEachTriangleHasItsDots) {
  const TexturedMesh mesh = test::rectangle(.05, .05, 10, 10);
  std::vector<Dot> dots;
  for (std::uint32_t t = 0; t < mesh.triangle_count(); ++t)
    for (int i = 0; i < 3; ++i) dots.push_back(test::dot_at(mesh, {t, {1, 0, 0}}));  // in a corner, all three
  const SurfaceQuality quality(mesh);
  EXPECT_LT(quality.triangle_sets(Sets{dots}).front().largest, 1e-12);
  EXPECT_GT(quality.balls(Sets{dots}).front().largest, 1e-3);  // balls do
}

TEST(SurfaceQuality, RandomDotsHaveTheDiscrepancyOfCoins) {
  const TexturedMesh mesh = test::sphere(.025, 40, 20);
  const SurfaceQuality quality(mesh);
  std::vector<std::vector<Dot>> dots;
  for (unsigned seed = 1; seed <= 16; ++seed) dots.push_back(test::random_dots(mesh, 1000, seed));
  Sets sets(dots.begin(), dots.end());
  // Shares are uniform for triangle sets: E[p(1-p)] = 1/6. Radii of balls are uniform up to .866 of the
  // diameter, the share is their square over that of the diameter.
  double squares = 0, of_balls = 0;
  for (const Discrepancy& d : quality.triangle_sets(sets)) squares += d.rms * d.rms / 16;
  for (const Discrepancy& d : quality.balls(sets)) of_balls += d.rms * d.rms / 16;
  EXPECT_NEAR(std::sqrt(squares * 1000), std::sqrt(1. / 6), .05);
  const double s = .75;  // largest share: (radius / diameter)^2 with radius sqrt(3) / 2 of it
  EXPECT_NEAR(std::sqrt(of_balls * 1000), std::sqrt(s / 3 - s * s / 5), .05);
}

TEST(SurfaceQuality, NearestIsTheNearestOfAllTriangles) {
  const TexturedMesh mesh = test::torus();
  const SurfaceQuality quality(mesh);
  for (const Dot& dot : test::random_dots(mesh, 200, 5)) {
    const Vector3d off = dot.position_O + 1e-3 * dot.normal_O.cast<double>();
    double best = 1;
    for (std::uint32_t t = 0; t < mesh.triangle_count(); ++t) {
      const auto b = nearest_in_triangle(off, mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2));
      best = std::min(best, (position(mesh, {t, b}) - off).norm());
    }
    EXPECT_DOUBLE_EQ((position(mesh, quality.nearest(off)) - off).norm(), best);
    EXPECT_LT((position(mesh, quality.nearest(dot.position_O)) - dot.position_O).norm(), 1e-12);
  }
}

TEST(SurfaceQuality, AGridOnAPlateHasItsHoleSpacingAndPath) {
  const double side = .05;
  const TexturedMesh mesh = test::rectangle(side, side, 3, 2);
  const SurfaceQuality quality(mesh);
  std::vector<Dot> dots;
  for (const Vector2d& p : test::grid_points(30))
    dots.push_back(test::dot_at(mesh, quality.nearest({side * p.x(), side * p.y(), 0})));
  EXPECT_NEAR(quality.largest_hole(dots), std::sqrt(.5), 1e-3);
  EXPECT_NEAR(quality.spacing(dots).smallest, 1 / std::sqrt(2 / std::numbers::sqrt3), 1e-6);
  EXPECT_NEAR(quality.path_constant(dots), 29. / 30 + 29. / 900, 1e-9);
}

TEST(SurfaceQuality, TheTwoSidesOfAThinPlateAreApart) {
  // Two plates a tenth of a pitch apart, facing away from each other; dots on one are not neighbors of dots
  // on the other.
  TexturedMesh back = test::rectangle(.05, .05, 2, 2);
  for (auto& triangle : back.triangles) std::swap(triangle[1], triangle[2]);
  const TexturedMesh mesh = test::both(test::rectangle(.05, .05, 2, 2), back, {0, 0, -.0002});
  const SurfaceQuality quality(mesh);
  std::vector<Dot> dots;
  for (std::uint32_t t = 0; t < mesh.triangle_count(); ++t)
    dots.push_back(test::dot_at(mesh, {t, {.2, .4, .4}}));
  EXPECT_GT(quality.spacing(dots).smallest, .2);
  const double both_sides = quality.largest_hole(dots);
  dots.erase(dots.begin(), dots.begin() + 7);  // one is left in front
  EXPECT_GT(quality.largest_hole(dots) / std::sqrt(static_cast<double>(dots.size())), 1.5 * both_sides / 4);
}

TEST(SurfaceQuality, ADotBeyondASharpFoldIsNear) {
  // One dot 5 mm from a fold of 6 degrees: the empty disc around a place on the other side reaches to it over
  // the fold.
  const double side = .04, angle = .1;
  const TexturedMesh mesh = test::folded_sheet(side, angle, 8, 8);
  const SurfaceQuality quality(mesh);
  std::vector<Dot> dots{test::dot_at(mesh, quality.nearest({.005, side / 2, 0}))};
  const double far_corner = Vector3d(side * std::cos(angle) - .005, side / 2, side * std::sin(angle)).norm();
  const double pitch = std::sqrt(2 * side * side);
  // From the far corners of both halves the ball reaches the fold only where it is as far as the dot is, or
  // farther.
  EXPECT_NEAR(quality.largest_hole(dots) * pitch, std::max(far_corner, std::hypot(side, 0)), 1e-3 * side);
  // Facing dots 2 and 5 mm from the fold are as far apart as the farther one is from the fold.
  dots.push_back(
      test::dot_at(mesh, quality.nearest({.002 * std::cos(angle), side / 2, .002 * std::sin(angle)})));
  const double densest = std::sqrt(2 / std::numbers::sqrt3 * mesh.area_m2() / 2);
  const Spacing spacing = quality.spacing(dots);
  EXPECT_NEAR(spacing.distances.back() * densest, .005, 1e-6);
}

TEST(SurfaceQuality, HolesOfRandomDotsOnASphereAreThoseOfDirections) {
  const double r = .025;
  const TexturedMesh mesh = test::sphere(r, 200, 100);
  std::vector<Vector3d> directions;
  const auto dots = test::random_dots(mesh, 2000, 4);
  for (const Dot& dot : dots) directions.push_back(dot.position_O.normalized());
  EXPECT_NEAR(SurfaceQuality(mesh).largest_hole(dots), sphere_largest_hole(directions), .01);
}

TEST(SurfaceQuality, IsTheSameForAnyNumberOfThreads) {
  const TexturedMesh mesh = test::torus();
  const auto dots = test::random_dots(mesh, 30'000, 6);
  const auto points = test::random_points(20'000, 6);
  const auto figures = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const SurfaceQuality quality(mesh);
    const Spectrum flat = plane_spectrum(points), spectrum = quality.spectrum(dots);
    return std::vector<double>{quality.triangle_sets(Sets{dots}).front().rms,
                               quality.balls(Sets{dots}).front().rms,
                               quality.largest_hole(dots),
                               quality.spacing(dots).spread,
                               spectrum.below_half,
                               flat.below_half,
                               flat.anisotropy,
                               plane_discrepancies(points)[2].rms,
                               plane_largest_hole(points)};
  };
  EXPECT_EQ(figures(1), figures(4));
}

TEST(SurfaceQuality, AWhiteSurfaceIsRefused) {
  const TexturedMesh mesh = test::finish(test::rectangle(.05, .05, 2, 2), 1);
  TexturedMesh white = mesh;
  for (auto& luminance : white.corner_luminance) luminance = {1, 1, 1};
  const ToneField tone(white, {});
  EXPECT_THROW(SurfaceQuality(white, &tone), InputError);
}

/// The centers of strata are a better placement than the thesis's jitter.
TEST(SurfaceQuality, CentroidIsBetterThanJitteredAndThatThanRandom) {
  const TexturedMesh mesh = test::sphere(.025);
  const SurfaceCurve curve(mesh);
  const ToneField tone(mesh, {});
  const SurfaceQuality quality(mesh);
  const auto place = [&](Sampler sampler) {
    SampleOptions options;
    options.dot_count = 20'000;
    options.sampler = sampler;
    return place_dots(curve, tone, options).dots;
  };
  const auto centroid = place(Sampler::kCentroid), jittered = place(Sampler::kJittered),
             random = place(Sampler::kRandom);
  const auto balls = quality.balls(Sets{centroid, jittered, random});
  EXPECT_LE(balls[0].rms, .8 * balls[1].rms);
  EXPECT_LE(balls[1].rms, .4 * balls[2].rms);
  EXPECT_LE(quality.largest_hole(centroid), 1.25);
  EXPECT_LE(quality.spectrum(centroid).below_half, .08);
  EXPECT_GE(quality.spectrum(jittered).below_half, .3);
  EXPECT_LE(quality.path_constant(centroid), 1);
}

}  // namespace
}  // namespace hilbrush
