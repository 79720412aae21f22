#include "sampling/options/sample_options.h"
#include "sampling/options/tone_options.h"
#include "tests/support/enum_name_table.h"

namespace hilbrush {
namespace {

TEST(OptionNames, NameEachChoiceBothWays) {
  expect_names_both_ways<kSamplerNames>();
  expect_names_both_ways<kCurveNames>();
  expect_names_both_ways<kDensityNames>();
  expect_names_both_ways<kUntexturedNames>();
}

TEST(OptionNames, AreThoseOfJobFiles) {
  EXPECT_STREQ(sampler_name(Sampler::kNiederreiter), "niederreiter");
  EXPECT_STREQ(curve_name(CurveKind::kPeano2), "peano2");
  EXPECT_STREQ(density_name(DensitySource::kGaussianCurvature), "gaussian_curvature");
  EXPECT_STREQ(untextured_name(Untextured::kAuto), "auto");
}

}  // namespace
}  // namespace hilbrush
