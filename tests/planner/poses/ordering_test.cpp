#include "planner/poses/ordering.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "tests/planner/workpieces.h"

namespace hilbrush {
namespace {

/// Dots on a plate, in whatever order, reached by J1 and J2 as if these were x and y.
std::vector<PathDot> random_plate(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(0, .03F);
  std::vector<PathDot> path(count);
  for (PathDot& dot : path) {
    dot.position_O = {uniform(random), uniform(random), 0};
    dot.arm = {4 * dot.position_O.x(), 4 * dot.position_O.y(), .1F,
               -4 * (dot.position_O.x() + dot.position_O.y())};
  }
  std::sort(path.begin(), path.end(), [](const PathDot& a, const PathDot& b) {  // strips, back and forth
    const int strip_a = static_cast<int>(a.position_O.y() / 3e-3F);
    const int strip_b = static_cast<int>(b.position_O.y() / 3e-3F);
    if (strip_a != strip_b) return strip_a < strip_b;
    return strip_a % 2 ? a.position_O.x() > b.position_O.x() : a.position_O.x() < b.position_O.x();
  });
  return path;
}

double path_s(const CellDescription& cell, const std::vector<PathDot>& path,
              const std::vector<std::uint32_t>& order) {
  const StepCost cost(cell);
  double sum = 0;
  for (std::size_t i = 1; i < order.size(); ++i)
    sum += static_cast<double>(cost(path[order[i - 1]].arm, path[order[i]].arm));
  return sum;
}

std::vector<std::uint32_t> as_it_is(std::size_t count) {
  std::vector<std::uint32_t> order(count);
  for (std::uint32_t i = 0; i < count; ++i) order[i] = i;
  return order;
}

void expect_permutation(std::vector<std::uint32_t> order, std::size_t count) {
  ASSERT_EQ(order.size(), count);
  std::sort(order.begin(), order.end());
  EXPECT_EQ(order, as_it_is(count));
}

TEST(Ordering, VisitsEveryDotOnceAndTakesLessTime) {
  const CellDescription cell = default_cell();
  for (const std::size_t count : {3U, 10U, 500U, 5000U}) {
    const auto path = random_plate(count, 7);
    const auto order = improved_order(cell, path, 0);
    const auto kicked = improved_order(cell, path, 5);
    expect_permutation(order, count);
    expect_permutation(kicked, count);
    const double before_s = path_s(cell, path, as_it_is(count));
    const double after_s = path_s(cell, path, order);
    EXPECT_LE(after_s, before_s + 1e-6) << count;
    EXPECT_LE(path_s(cell, path, kicked), after_s + 1e-4) << count;
    if (count >= 500) {
      EXPECT_LT(after_s, .95 * before_s) << count;
    }
  }
}

TEST(Ordering, LengthOfATourOverRandomDotsIsNearTheOptimum) {
  // With time proportional to distance (no ticks, no ramps, one speed) the path is the plane's shortest tour,
  // known to be .7124 sqrt(n A) for many dots; 2-opt and Or-opt alone are 5 to 10 per cent above, kicks take
  // half of that off.
  CellDescription cell = default_cell();
  cell.timing.tick_s = 0;
  cell.timing.settle_min_s = cell.timing.settle_max_s = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    cell.axes[i].speed_max = 1e-3;
    cell.axes[i].acceleration_max = 1e9;
  }
  const std::size_t count = 8000;
  auto path = random_plate(count, 9);
  // The slowest of two axes is the larger of two coordinates. Turned by an eighth of a turn, that is half the
  // sum of their magnitudes in any other frame: a metric too, but not Euclid's; its constant lies within a
  // factor of sqrt 2.
  for (PathDot& dot : path) dot.arm = {dot.position_O.x(), dot.position_O.y(), 0, 0};
  const double unit_s = std::sqrt(static_cast<double>(count) * .03 * .03) / 1e-3;
  const double plain = path_s(cell, path, improved_order(cell, path, 0)) / unit_s;
  const double kicked = path_s(cell, path, improved_order(cell, path, 10)) / unit_s;
  EXPECT_LT(plain, .7124 * 1.10);
  EXPECT_GT(kicked, .7124 / std::sqrt(2.));
  EXPECT_LT(kicked, .975 * plain);
}

TEST(Ordering, SameOrderEveryTimeAndEqualDotsDoNoHarm) {
  const CellDescription cell = default_cell();
  auto path = random_plate(2000, 11);
  for (std::size_t i = 1; i < path.size(); i += 3) path[i] = path[i - 1];
  const auto order = improved_order(cell, path, 3);
  expect_permutation(order, path.size());
  EXPECT_EQ(order, improved_order(cell, path, 3));
  const std::vector<PathDot> one_place(100, path[0]);
  expect_permutation(improved_order(cell, one_place, 2), 100);
}

TEST(Ordering, LongPathsAreImprovedInBlocks) {
  const CellDescription cell = default_cell();
  const auto path = random_plate(70'000, 13);
  const auto order = improved_order(cell, path, 0);
  expect_permutation(order, path.size());
  EXPECT_LT(path_s(cell, path, order), .9 * path_s(cell, path, as_it_is(path.size())));
}

}  // namespace
}  // namespace hilbrush
