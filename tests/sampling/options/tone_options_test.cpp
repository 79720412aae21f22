#include "sampling/options/tone_options.h"

#include <gtest/gtest.h>

namespace hilbrush {
namespace {

const ToneCurve kCurve{{0, .3, .8, 1}, {0, .2, .9, 2}};

TEST(ToneCurve, InverseGivesTheWantedToneBack) {
  for (const double wanted : {0., .1, .3, .55, .8, .9, 1.})
    EXPECT_NEAR(kCurve.inverse(kCurve(wanted)), wanted, 1e-15);
}

TEST(ToneCurve, InverseEndsWhereTheCurveEnds) {
  EXPECT_EQ(kCurve.inverse(-1), 0);
  EXPECT_EQ(kCurve.inverse(3), 1);
}

TEST(ToneCurve, InverseOfALevelPartIsItsStart) {
  const ToneCurve level{{0, .2, .6, 1}, {0, .5, .5, 1}};
  EXPECT_EQ(level.inverse(.5), .2);
}

TEST(ToneCurve, WithoutKnotsIsTheIdentity) {
  EXPECT_EQ(ToneCurve{}(.37), .37);
  EXPECT_EQ(ToneCurve{}.inverse(.37), .37);
}

}  // namespace
}  // namespace hilbrush
