#include "daemon/pipeline/skipped_figures.h"

#include <gtest/gtest.h>

#include "sampling/base/angles.h"

namespace hilbrush {
namespace {

SkippedDot tilt(double excess_deg) {
  return {
      0, SkipReason::kIncidence, "x", "tilt past its limit", excess_deg * kDegree, SkipMeasure::kExcessAngle};
}
SkippedDot beam(double free_mm) {
  return {
      0, SkipReason::kOccluded, "x", "beam blocked by the object", free_mm * 1e-3, SkipMeasure::kFreeLength};
}

TEST(SkippedFigures, AreCountedByWhatTheyAre) {
  const auto figures = skipped_figures({beam(12), tilt(1), beam(3), tilt(5.3), tilt(2.1)});
  ASSERT_EQ(figures.size(), 2u);
  EXPECT_EQ(figures[0].reason, "incidence");
  EXPECT_EQ(figures[0].count, 3u);
  EXPECT_EQ(figures[0].unit, "deg");
  EXPECT_NEAR(figures[0].typical, 2.1, 1e-12);
  EXPECT_NEAR(figures[0].worst, 5.3, 1e-12);
  EXPECT_EQ(figures[0].text, "tilt past its limit, typically by 2.1, at most by 5.3 degrees");
  EXPECT_EQ(figures[1].text, "beam blocked by the object, typically 12 mm from the dot, nearest 3 mm");
}

TEST(SkippedFigures, WithoutAmountsTheSentenceStands) {
  SkippedDot energy;
  energy.reason = SkipReason::kEnergy;
  energy.detail = "the laser cannot";
  const auto figures = skipped_figures({energy});
  ASSERT_EQ(figures.size(), 1u);
  EXPECT_EQ(figures[0].text, "the laser cannot");
  EXPECT_TRUE(figures[0].unit.empty());
  energy.what = "the laser cannot deliver the energy";
  EXPECT_EQ(skipped_figures({energy})[0].text, "the laser cannot deliver the energy") << "no amount of 0 mm";
  EXPECT_TRUE(skipped_figures({}).empty());
}

}  // namespace
}  // namespace hilbrush
