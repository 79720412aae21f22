#include "sampling/blue/touching_balls.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "sampling/blue/coloring.h"

namespace hilbrush {
namespace {

/// Balls of radii over three orders of magnitude.
std::vector<SizedBall> random_balls(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<SizedBall> balls(count);
  for (SizedBall& ball : balls) {
    ball.center_O = {unit(random), unit(random), unit(random) - .5};
    ball.radius_m = .2 * std::pow(10, -3 * unit(random));
  }
  return balls;
}

bool accept_odd_sums(std::uint32_t a, std::uint32_t b) {
  return (a + b) % 2 == 1;
}

TEST(TouchingBalls, FindsWhatBruteForceFinds) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    const std::vector<SizedBall> balls = random_balls(700, seed);
    const IndexLists lists = find_touching_balls(balls, accept_odd_sums);
    ASSERT_EQ(lists.count(), balls.size());
    for (std::uint32_t i = 0; i < balls.size(); ++i) {
      std::vector<std::uint32_t> expected, found(lists[i].begin(), lists[i].end());
      for (std::uint32_t j = 0; j < balls.size(); ++j)
        if (j != i && accept_odd_sums(i, j) &&
            (balls[i].center_O - balls[j].center_O).norm() < balls[i].radius_m + balls[j].radius_m)
          expected.push_back(j);
      std::sort(found.begin(), found.end());
      ASSERT_EQ(found, expected) << "ball " << i << ", seed " << seed;
    }
  }
}

TEST(TouchingBalls, SameListsForAnyNumberOfThreads) {
  const std::vector<SizedBall> balls = random_balls(2000, 7);
  std::vector<IndexLists> results;
  for (const std::size_t threads : {1u, 4u}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    results.push_back(find_touching_balls(balls, accept_odd_sums));
  }
  EXPECT_EQ(results[0].begins, results[1].begins);
  EXPECT_EQ(results[0].indices, results[1].indices);
}

TEST(TouchingBalls, NoneAndOne) {
  EXPECT_EQ(find_touching_balls({}, accept_odd_sums).count(), 0u);
  const std::vector<SizedBall> one{{Eigen::Vector3d::Zero(), 1}};
  EXPECT_TRUE(find_touching_balls(one, accept_odd_sums)[0].empty());
}

TEST(Coloring, StretchesOfAColorDoNotTouch) {
  const std::vector<SizedBall> balls = random_balls(3000, 5);
  std::vector<SizedBall> along = balls;
  std::sort(along.begin(), along.end(),
            [](const SizedBall& a, const SizedBall& b) { return a.center_O.x() < b.center_O.x(); });
  for (SizedBall& ball : along) ball.radius_m = .01;
  const IndexLists neighbors = find_touching_balls(along, [](std::uint32_t, std::uint32_t) { return true; });
  const Coloring coloring = color_stretches(neighbors);
  const std::size_t stretch_count = (along.size() + Coloring::kStretch - 1) / Coloring::kStretch;
  std::vector<std::size_t> color_of(stretch_count, ~std::size_t{0});
  for (std::size_t color = 0; color < coloring.stretches.size(); ++color)
    for (const std::uint32_t stretch : coloring.stretches[color]) {
      EXPECT_EQ(color_of[stretch], ~std::size_t{0}) << "colored twice";
      color_of[stretch] = color;
    }
  for (std::size_t i = 0; i < along.size(); ++i) {
    ASSERT_LT(color_of[i / Coloring::kStretch], coloring.stretches.size());
    for (const std::uint32_t j : neighbors[i]) {
      if (i / Coloring::kStretch == j / Coloring::kStretch) continue;
      ASSERT_NE(color_of[i / Coloring::kStretch], color_of[j / Coloring::kStretch]);
    }
  }
  EXPECT_LT(coloring.stretches.size(), stretch_count);
}

}  // namespace
}  // namespace hilbrush
