#include "sampling/curve/sequence.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <vector>

namespace hilbrush {
namespace {

/// Equation 2.11 to the letter.
double mirrored(std::uint64_t k) {
  double number = 0, digit = .5;
  for (; k > 0; k /= 2, digit /= 2) number += static_cast<double>(k % 2) * digit;
  return number;
}

/// The numbers of a sampler, each from its definition, in order of their making.
using Definition = std::function<double(std::uint64_t index, std::uint64_t count)>;

void expect_ranked(Sampler sampler, const Definition& definition) {
  for (const std::uint64_t count :
       {1u, 2u, 3u, 4u, 5u, 7u, 8u, 27u, 28u, 29u, 100u, 156u, 157u, 1000u, 4096u, 5555u}) {
    std::vector<double> sorted;
    for (std::uint64_t i = 0; i < count; ++i) sorted.push_back(definition(i, count));
    std::sort(sorted.begin(), sorted.end());
    const Sequence sequence(sampler, count, 1);
    for (std::uint64_t i = 0; i < count; ++i) ASSERT_EQ(sequence.at(i), sorted[i]) << i << " of " << count;
  }
}

TEST(Sequence, HaltonIsVanDerCorputSorted) {
  expect_ranked(Sampler::kHalton, [](std::uint64_t i, std::uint64_t) { return mirrored(i); });
}

TEST(Sequence, HammersleyIsTheFirstCoordinate) {
  expect_ranked(Sampler::kHammersley, [](std::uint64_t i, std::uint64_t count) {
    return static_cast<double>(i) / static_cast<double>(count);
  });
}

TEST(Sequence, SobolIsGrayCodedAndDropsItsFirstHundred) {
  expect_ranked(Sampler::kSobol, [](std::uint64_t i, std::uint64_t) {
    const std::uint64_t k = i + 101;
    return mirrored(k ^ (k >> 1));
  });
}

TEST(Sequence, NiederreiterStartsOneEarlier) {
  expect_ranked(Sampler::kNiederreiter, [](std::uint64_t i, std::uint64_t) {
    const std::uint64_t k = i + 100;
    return mirrored(k ^ (k >> 1));
  });
}

/// Every half, quarter ... of the interval has its share, give or take two: what "low discrepancy" buys.
TEST(Sequence, LowDiscrepancyFillsEveryDyadicInterval) {
  const std::uint64_t count = 100'000;
  for (const Sampler sampler :
       {Sampler::kHalton, Sampler::kHammersley, Sampler::kSobol, Sampler::kNiederreiter}) {
    const Sequence sequence(sampler, count, 1);
    std::vector<int> of_interval(64);
    double last = -1;
    for (std::uint64_t i = 0; i < count; ++i) {
      const double number = sequence.at(i);
      ASSERT_GT(number, last);
      ASSERT_LT(number, 1);
      last = number;
      ++of_interval[static_cast<std::size_t>(64 * number)];
    }
    for (const int inside : of_interval) EXPECT_NEAR(inside, static_cast<double>(count) / 64, 2);
  }
}

TEST(Sequence, RisesForEverySamplerAndSeed) {
  for (const Sampler sampler : {Sampler::kJittered, Sampler::kEven, Sampler::kRandom})
    for (const std::uint64_t seed : {1u, 2u, 77u}) {
      const Sequence sequence(sampler, 3001, seed);
      for (std::uint64_t i = 1; i < 3001; ++i)
        ASSERT_LE(sequence.at(i - 1), sequence.at(i))
            << "sampler " << static_cast<int>(sampler) << " seed " << seed;
      EXPECT_GE(sequence.at(0), 0);
      EXPECT_LT(sequence.at(3000), 1);
    }
}

}  // namespace
}  // namespace hilbrush
