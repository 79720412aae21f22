#include "sampling/base/progress.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

namespace hilbrush {
namespace {

TEST(Progress, WithoutListenerDoesNothing) {
  const Progress none;
  EXPECT_NO_THROW(none(.5));
  EXPECT_NO_THROW(none.part(.2, .4)(.5));
  EXPECT_NO_THROW(none.step(1, 3));
  EXPECT_NO_THROW(Progress(std::function<void(double)>())(1)) << "an empty function is no listener either";
}

TEST(Progress, PartsOfPartsFillTheWhole) {
  std::vector<double> fractions;
  const Progress progress = [&](double fraction) { fractions.push_back(fraction); };
  progress(0);
  progress.part(0, .5).step(1, 2);
  const Progress second = progress.part(.5, 1);
  second.part(0, .5)(1);
  second.part(.5, 1)(1);
  EXPECT_EQ(fractions, (std::vector<double>{0, .25, .75, 1}));
}

TEST(Progress, TheListenerMayEndTheStage) {
  const Progress progress = [](double) { throw std::runtime_error("stopped"); };
  EXPECT_THROW(progress.part(0, .5)(0), std::runtime_error);
}

}  // namespace
}  // namespace hilbrush
