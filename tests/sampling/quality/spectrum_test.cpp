#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>

#include "sampling/base/input_error.h"
#include "sampling/quality/point_transform.h"
#include "sampling/quality/quality.h"
#include "tests/sampling/quality/point_sets.h"
#include "tests/support/meshes.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d;

TEST(PointTransform, IsTheSumOverThePoints) {
  auto points = test::random_points(300, 4);
  points.emplace_back(0, 0);
  points.emplace_back(0, 1 - 1e-12);
  points.emplace_back(1, .5);  // the border counts as well
  const int highest = 37;
  const PointTransform transform(points, highest);
  double worst = 0;
  for (int kx = 0; kx <= highest; ++kx)
    for (int ky = -highest; ky <= highest; ++ky) {
      std::complex<double> sum = 0;
      for (const Vector2d& p : points)
        sum += std::polar(1., -2 * std::numbers::pi * (kx * p.x() + ky * p.y()));
      worst = std::max(worst, std::abs(sum - transform.at(kx, ky)));
    }
  EXPECT_LT(worst, 1e-6 * std::sqrt(static_cast<double>(points.size())));
}

TEST(PlaneSpectrum, OfAGridIsEmptyButForItsPeaks) {
  const Spectrum spectrum = plane_spectrum(test::grid_points(50));
  EXPECT_LT(spectrum.below_half, 1e-8);
  EXPECT_LT(spectrum.below_quarter, 1e-8);
  // At the principal frequency there is all the power (N) along x and along y and none between.
  EXPECT_GT(spectrum.peak, 5);
  EXPECT_GT(spectrum.anisotropy, 1);
}

TEST(PlaneSpectrum, OfWhiteNoiseIsOneEverywhere) {
  std::vector<Spectrum> spectra;
  for (unsigned seed = 1; seed <= 8; ++seed)
    spectra.push_back(plane_spectrum(test::random_points(20'000, seed)));
  const Spectrum mean = average(spectra);
  EXPECT_NEAR(mean.below_half, 1, .05);
  EXPECT_NEAR(mean.below_quarter, 1, .1);
  ASSERT_EQ(mean.rings.size(), 80u);
  for (std::size_t i = 4; i < mean.rings.size(); ++i) {
    EXPECT_NEAR(mean.rings[i].power, 1, .15) << "ring " << i;
    EXPECT_NEAR(mean.rings[i].anisotropy, 1, .25) << "ring " << i;
  }
  ASSERT_EQ(mean.directions.size(), 36u);
  EXPECT_LT(mean.anisotropy, .2);
}

/// One random point in each square of a grid: P(f) = 1 - |sinc(f_x) sinc(f_y)|^2, from the transform of a
/// square. Its mean below half the principal frequency.
double jitter_below_half() {
  const auto sinc2 = [](double f) {
    return std::abs(f) < 1e-9 ? 1 : std::pow(std::sin(std::numbers::pi * f) / (std::numbers::pi * f), 2);
  };
  double sum = 0, weight = 0;
  for (double x = -.5; x < .5; x += .002)
    for (double y = -.5; y < .5; y += .002)
      if (x * x + y * y < .25) {
        sum += 1 - sinc2(x) * sinc2(y);
        weight += 1;
      }
  return sum / weight;
}

TEST(PlaneSpectrum, OfJitterIsOneLessTheSquaresSpectrum) {
  std::vector<Spectrum> spectra;
  for (unsigned seed = 1; seed <= 4; ++seed)
    spectra.push_back(plane_spectrum(test::jittered_points(150, seed)));
  const Spectrum mean = average(spectra);
  EXPECT_NEAR(mean.below_half, jitter_below_half(), .01);
}

TEST(PlaneSpectrum, OfManyPointsIsTheMeanOverSquares) {
  const Spectrum spectrum = plane_spectrum(test::jittered_points(300, 2));  // 90,000: four squares
  EXPECT_NEAR(spectrum.below_half, jitter_below_half(), .02);
  EXPECT_NEAR(spectrum.rings[60].frequency, 60.5 / 40, 1e-12);
  EXPECT_NEAR(spectrum.rings[60].power, 1, .05);
}

TEST(SurfaceSpectrum, OfRandomDotsIsOne) {
  const TexturedMesh mesh = test::sphere(.025, 60, 30);
  const Spectrum spectrum = SurfaceQuality(mesh).spectrum(test::random_dots(mesh, 20'000, 1));
  EXPECT_NEAR(spectrum.below_half, 1, .08);
  for (const Spectrum::Ring& ring : spectrum.rings)
    EXPECT_NEAR(ring.power, 1, .12) << "at " << ring.frequency;
  EXPECT_TRUE(spectrum.directions.empty());
}

TEST(SurfaceSpectrum, OfAGridOnAPlateIsEmptyBelow) {
  const TexturedMesh mesh = test::rectangle(.04, .04, 7, 5);
  const SurfaceQuality quality(mesh);
  std::vector<Dot> dots;
  for (const Vector2d& p : test::grid_points(80))
    dots.push_back(test::dot_at(mesh, quality.nearest({.04 * p.x(), .04 * p.y(), 0})));
  const Spectrum spectrum = quality.spectrum(dots);
  EXPECT_LT(spectrum.below_half, .01);
  EXPECT_GT(spectrum.peak, 5);
}

/// The even density is subtracted with its own curvature, borders and tones, so that the low power of a
/// spiral remains low.
TEST(SurfaceSpectrum, OfAnEvenSpiralOnASphereIsLowBelow) {
  const TexturedMesh mesh = test::sphere(.025, 96, 48);
  const SurfaceQuality quality(mesh);
  std::vector<Dot> dots;
  for (const auto& direction : test::spiral_directions(10'000))
    dots.push_back(test::dot_at(mesh, quality.nearest(.025 * direction)));
  EXPECT_LT(quality.spectrum(dots).below_half, .02);
}

TEST(SurfaceSpectrum, NeedsDotsAndFlatParts) {
  const TexturedMesh mesh = test::sphere(.025);
  const SurfaceQuality quality(mesh);
  EXPECT_THROW(quality.spectrum(test::random_dots(mesh, 50, 1)), InputError);
  EXPECT_THROW(quality.spectrum(test::random_dots(mesh, 120, 1)), InputError);  // patches of half the sphere
}

}  // namespace
}  // namespace hilbrush
