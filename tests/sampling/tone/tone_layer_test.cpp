#include "sampling/tone/tone_layer.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <vector>

namespace hilbrush {
namespace {

using Eigen::Vector2d;
constexpr unsigned kSeed = 20261130;

ToneLayer noise(std::mt19937& random, int width, int height) {
  std::uniform_real_distribution<float> uniform(0, 1);
  std::vector<float> tones(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (float& tone : tones) tone = uniform(random);
  return {width, height, std::move(tones)};
}

/// A square of that size, turned.
std::array<Vector2d, 4> turned_square(const Vector2d& middle, double size, double angle) {
  const Vector2d u = .5 * size * Vector2d(std::cos(angle), std::sin(angle)), v(-u.y(), u.x());
  return {middle - u - v, middle + u - v, middle + u + v, middle - u + v};
}

/// The same square in n x n parts, each integrated for itself.
TexelIntegral sum_of_parts(const ToneLayer& layer, const std::array<Vector2d, 4>& square, int n,
                           TexelAddressing addressing) {
  const Vector2d u = (square[1] - square[0]) / n, v = (square[3] - square[0]) / n;
  TexelIntegral sum;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const Vector2d low = square[0] + i * u + j * v;
      const TexelIntegral part = layer.integrate(
          std::array{low, Vector2d(low + u), Vector2d(low + u + v), Vector2d(low + v)}, addressing);
      sum.mass += part.mass;
      sum.first += part.first;
      sum.square += part.square;
    }
  return sum;
}

/// Whole squares are walked, their parts lie in a few cells or in one: three ways to the same integrals.
TEST(ToneLayer, PartsSumToTheWholeHoweverTheyAreIntegrated) {
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const ToneLayer layer = noise(random, 61, 47);
  for (const bool repeats : {true, false})
    for (const double size : {.4, 3., 11., 40., 130.})
      for (const int n : {4, 40}) {
        const auto square =
            turned_square({30 + 40 * uniform(random), 20 + 40 * uniform(random)}, size, 3 * uniform(random));
        const TexelAddressing addressing{repeats, repeats};
        const TexelIntegral whole = layer.integrate(square, addressing);
        const TexelIntegral parts = sum_of_parts(layer, square, n, addressing);
        const double area = size * size;
        EXPECT_NEAR(whole.mass / area, parts.mass / area, 1e-11) << "size " << size << " in " << n;
        EXPECT_NEAR((whole.first - parts.first).norm() / area, 0, 1e-9) << "size " << size << " in " << n;
        EXPECT_NEAR(whole.square / area, parts.square / area, 1e-11) << "size " << size << " in " << n;
        EXPECT_GT(whole.mass, 0);
      }
}

TEST(ToneLayer, EdgesOnTheLinesBetweenTexelsCountOnce) {
  std::mt19937 random(kSeed);
  const ToneLayer layer = noise(random, 16, 16);
  for (const int side : {1, 2, 5, 9}) {
    const std::array square{Vector2d(3, 4), Vector2d(3 + side, 4), Vector2d(3 + side, 4 + side),
                            Vector2d(3, 4 + side)};
    double mass = 0;
    for (int i = 0; i < side; ++i)
      for (int j = 0; j < side; ++j)
        for (const int corner : {0, 1, 2, 3})
          mass += .25 * layer.at(Vector2d(3 + i + corner % 2, 4 + j + corner / 2), {});
    EXPECT_NEAR(layer.integrate(square, {}).mass, mass, 1e-11) << side;
    const std::array mirrored{square[0], square[3], square[2], square[1]};
    EXPECT_NEAR(layer.integrate(mirrored, {}).mass, -mass, 1e-11) << side;
  }
}

/// What the halves of a tiny polygon weigh is right to the share of the polygon, not of a texel.
TEST(ToneLayer, TinyPolygonsLoseNoDigits) {
  std::mt19937 random(kSeed);
  const ToneLayer layer = noise(random, 16, 16);
  for (const double size : {1e-3, 1e-6}) {
    const auto square = turned_square({7.3, 5.6}, size, .3);
    EXPECT_NEAR(layer.integrate(square, {}).mass / (size * size) / layer.at({7.3, 5.6}, {}), 1, 1e-8) << size;
  }
}

}  // namespace
}  // namespace hilbrush
