#include "sampling/parametric/point_sets.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "sampling/base/input_error.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d;

/// A (0, m, 2)-net in base 2: every dyadic rectangle of area 2^-m holds exactly one of 2^m points
/// (equation 2.13).
void expect_net(std::span<const Vector2d> points, int m) {
  for (int across = 0; across <= m; ++across) {
    std::map<std::pair<int, int>, int> inside;
    for (const Vector2d& p : points)
      ++inside[{static_cast<int>(p.x() * (1 << across)), static_cast<int>(p.y() * (1 << (m - across)))}];
    EXPECT_EQ(inside.size(), std::size_t{1} << m) << across << " of " << m << " halvings across";
  }
}

TEST(PlaneSet, SobolAndNiederreiterAreNetsFromMultiplesOfTheirSize) {
  for (const int m : {3, 6, 9}) {
    const std::uint64_t size = std::uint64_t{1} << m;
    const auto sobol = plane_set(PlaneSet::kSobol, 2048, 1),
               niederreiter = plane_set(PlaneSet::kNiederreiter, 2048, 1);
    // Point 0 of both sets is number 101 and 100 of the sequence.
    const std::uint64_t from = (128 + size - 1) / size * size;
    expect_net(std::span(sobol).subspan(from - 101, size), m);
    expect_net(std::span(niederreiter).subspan(from - 100, size), m);
  }
}

TEST(PlaneSet, SobolByItsPublishedFirstPoints) {
  // Joe and Kuo's table begins (1/2, 1/2), (3/4, 1/4), (1/4, 3/4), (3/8, 3/8), (7/8, 7/8), (5/8, 1/8), (1/8,
  // 5/8); numbers 1 to 7 shifted by 128 differ in the eighth digit and in the digit of 128 itself.
  const auto points = plane_set(PlaneSet::kNiederreiter, 64, 1);
  const Vector2d published[] = {{.5, .5},     {.75, .25},   {.25, .75},  {.375, .375},
                                {.875, .875}, {.625, .125}, {.125, .625}};
  const Vector2d of_128 = points[28];
  for (int k = 1; k <= 7; ++k) {
    // Adding numbers without carry: all digits of `published` are above those of psi_2(gray(128)) in x.
    EXPECT_NEAR(points[static_cast<std::size_t>(28 + k)].x() - of_128.x(), published[k - 1].x(), 1e-9) << k;
    const auto without_carry = [](double a, double b) {
      return static_cast<double>(static_cast<std::uint32_t>(a * 0x1p32) ^
                                 static_cast<std::uint32_t>(b * 0x1p32)) *
             0x1p-32;
    };
    EXPECT_NEAR(without_carry(points[static_cast<std::size_t>(28 + k)].y(), of_128.y()), published[k - 1].y(),
                1e-9);
  }
}

TEST(PlaneSet, HaltonAndHammersleyAsDefined) {
  const auto halton = plane_set(PlaneSet::kHalton, 10, 1),
             hammersley = plane_set(PlaneSet::kHammersley, 10, 1);
  EXPECT_EQ(halton[0], Vector2d(0, 0));
  EXPECT_NEAR((halton[5] - Vector2d(5. / 8, 7. / 9)).norm(), 0, 1e-15);
  EXPECT_NEAR((halton[9] - Vector2d(9. / 16, 1. / 27)).norm(), 0, 1e-15);
  EXPECT_NEAR((hammersley[6] - Vector2d(3. / 8, .65)).norm(), 0, 1e-15);
}

TEST(PlaneSet, JitteredHasOneInEachSquare) {
  for (const std::uint64_t count : {1u, 16u, 17u, 1000u}) {
    const auto points = plane_set(PlaneSet::kJittered, count, 5);
    const auto side = static_cast<std::uint64_t>(std::ceil(std::sqrt(static_cast<double>(count)) - 1e-9));
    ASSERT_EQ(points.size(), side * side);
    for (std::uint64_t i = 0; i < points.size(); ++i) {
      EXPECT_EQ(static_cast<std::uint64_t>(points[i].x() * static_cast<double>(side)), i % side);
      EXPECT_EQ(static_cast<std::uint64_t>(points[i].y() * static_cast<double>(side)), i / side);
    }
  }
}

TEST(PlaneSet, SeedsDifferAndRepeat) {
  EXPECT_EQ(plane_set(PlaneSet::kRandom, 100, 3), plane_set(PlaneSet::kRandom, 100, 3));
  EXPECT_NE(plane_set(PlaneSet::kRandom, 100, 3), plane_set(PlaneSet::kRandom, 100, 4));
  EXPECT_THROW(plane_set(PlaneSet::kSobol, std::uint64_t{1} << 33, 1), InputError);
}

TEST(SphereSet, EqualAreas) {
  for (const auto& [set, name] : kPlaneSetNames) {
    const auto points = sphere_set(set, 10'000, 1);
    const Eigen::Vector3d axis = Eigen::Vector3d(1, 2, 3).normalized();
    double inside = 0;
    for (const auto& p : points) {
      EXPECT_NEAR(p.norm(), 1, 1e-12);
      inside += p.dot(axis) > .6;
    }
    EXPECT_NEAR(inside / static_cast<double>(points.size()), .2, .02) << name;
  }
}

}  // namespace
}  // namespace hilbrush
