#include "sampling/base/random.h"

#include <gtest/gtest.h>

#include <limits>

namespace hilbrush {
namespace {

TEST(Random, SplitMix64GivesThePublishedNumbers) {
  // The first outputs for seed 1234567, as the reference implementation
  // (https://prng.di.unimi.it/splitmix64.c) gives.
  constexpr std::uint64_t kExpected[] = {6457827717110365317u, 3203168211198807973u, 9817491932198370423u,
                                         4593380528125082431u, 16408922859458223821u};
  std::uint64_t state = 1234567;
  for (const std::uint64_t expected : kExpected) {
    EXPECT_EQ(splitmix64(state), expected);
    state += kGoldenGamma;
  }
}

TEST(Random, TheUnitIntervalIsOpenAtOne) {
  EXPECT_EQ(unit_interval(0), 0);
  EXPECT_EQ(unit_interval(std::uint64_t{1} << 63), .5);
  EXPECT_EQ(unit_interval(std::numeric_limits<std::uint64_t>::max()), 1 - 0x1p-53);
}

}  // namespace
}  // namespace hilbrush
