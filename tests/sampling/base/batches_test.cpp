#include "sampling/base/batches.h"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace hilbrush {
namespace {

using Batches = std::vector<std::pair<std::size_t, std::size_t>>;

Batches batches_of(std::size_t count, std::size_t batch_size, const Progress& progress = {}) {
  Batches batches;
  for_batches(count, batch_size, progress,
              [&](std::size_t begin, std::size_t end) { batches.emplace_back(begin, end); });
  return batches;
}

TEST(Batches, CoverEverythingOnceInOrder) {
  EXPECT_EQ(batches_of(10, 4), (Batches{{0, 4}, {4, 8}, {8, 10}}));
  EXPECT_EQ(batches_of(8, 4), (Batches{{0, 4}, {4, 8}}));
  EXPECT_EQ(batches_of(1, 4), (Batches{{0, 1}}));
  EXPECT_EQ(batches_of(0, 4), Batches());
}

TEST(Batches, ReportAfterEachHowMuchIsDone) {
  std::vector<double> fractions;
  batches_of(10, 4, [&](double fraction) { fractions.push_back(fraction); });
  EXPECT_EQ(fractions, (std::vector<double>{.4, .8, 1}));
}

}  // namespace
}  // namespace hilbrush
