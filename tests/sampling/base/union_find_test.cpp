#include "sampling/base/union_find.h"

#include <gtest/gtest.h>

#include <random>

namespace hilbrush {
namespace {

TEST(UnionFind, EveryNumberBeginsAlone) {
  UnionFind sets(3);
  EXPECT_EQ(sets.size(), 3u);
  for (std::uint32_t i = 0; i < 3; ++i) EXPECT_EQ(sets.root(i), i);
}

TEST(UnionFind, UnitesOnlySetsThatAreApart) {
  UnionFind sets(6);
  EXPECT_TRUE(sets.unite(5, 3));
  EXPECT_TRUE(sets.unite(4, 5));
  EXPECT_FALSE(sets.unite(3, 4));
  EXPECT_EQ(sets.root(5), 3u);
  EXPECT_EQ(sets.root(4), 3u);
  EXPECT_EQ(sets.root(2), 2u);
}

TEST(UnionFind, TheRootIsTheSmallestOfItsSet) {
  constexpr std::uint32_t kCount = 200;
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    std::mt19937 random(seed);
    UnionFind sets(kCount);
    std::vector<std::uint32_t> smallest(kCount);  // by relabeling everything, which is slow and plainly right
    std::iota(smallest.begin(), smallest.end(), 0u);
    for (int i = 0; i < 150; ++i) {
      const auto a = static_cast<std::uint32_t>(random() % kCount);
      const auto b = static_cast<std::uint32_t>(random() % kCount);
      const std::uint32_t from = std::max(smallest[a], smallest[b]);
      const std::uint32_t to = std::min(smallest[a], smallest[b]);
      EXPECT_EQ(sets.unite(a, b), from != to) << "seed " << seed;
      std::replace(smallest.begin(), smallest.end(), from, to);
    }
    for (std::uint32_t i = 0; i < kCount; ++i) ASSERT_EQ(sets.root(i), smallest[i]) << "seed " << seed;
  }
}

}  // namespace
}  // namespace hilbrush
