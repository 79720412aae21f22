#include "daemon/execution/duration_histogram.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace hilbrush {
namespace {

TEST(DurationHistogramTest, QuantilesAreWithinABinOfTheTruthAndNeverBelowIt) {
  std::mt19937 random(3);
  std::lognormal_distribution<double> duration(-8, 1.5);
  DurationHistogram histogram, half;
  std::vector<double> all;
  for (int i = 0; i < 20000; ++i) {
    all.push_back(duration(random));
    (i % 2 == 0 ? histogram : half).add(all.back());
  }
  histogram.add(half);
  std::sort(all.begin(), all.end());
  EXPECT_EQ(histogram.count(), all.size());
  EXPECT_EQ(histogram.longest_s(), all.back());
  for (const double q : {.01, .5, .9, .99, .9999, 1.}) {
    const double truth = all[static_cast<std::size_t>(std::ceil(q * static_cast<double>(all.size()))) - 1];
    EXPECT_GE(histogram.quantile_s(q), truth * (1 - 1e-12)) << q;
    EXPECT_LE(histogram.quantile_s(q), truth * 1.036) << q;
  }
}

TEST(DurationHistogramTest, TakesAnyDuration) {
  DurationHistogram histogram;
  EXPECT_EQ(histogram.quantile_s(.5), 0);
  for (const double duration : {0., -1., 1e-12, 1e9}) histogram.add(duration);
  EXPECT_EQ(histogram.count(), 4u);
  EXPECT_GE(histogram.quantile_s(1), 1000);
}

}  // namespace
}  // namespace hilbrush
