#include "sampling/parametric/parametric.h"
#include "sampling/parametric/point_sets.h"
#include "sampling/quality/quality.h"
#include "tests/support/enum_name_table.h"

namespace hilbrush {
namespace {

TEST(QualityNames, NameEachChoiceBothWays) {
  expect_names_both_ways<kParametricShapeNames>();
  expect_names_both_ways<kParametricDensityNames>();
  expect_names_both_ways<kAreaMethodNames>();
  expect_names_both_ways<kPlaneSetNames>();
  expect_names_both_ways<kPlaneCurveNames>();
}

TEST(QualityNames, AreThoseOfTheCommandLineAndOfReports) {
  EXPECT_STREQ(name_of(kParametricShapeNames, ParametricShape::kEqualAreaSphere), "equal_area_sphere");
  EXPECT_STREQ(name_of(kParametricDensityNames, ParametricDensity::kUPlusV), "u+v");
  EXPECT_STREQ(name_of(kAreaMethodNames, AreaMethod::kFirstFundamentalForm), "first_fundamental_form");
  EXPECT_STREQ(name_of(kPlaneSetNames, PlaneSet::kNiederreiter), "niederreiter");
  EXPECT_STREQ(plane_curve_name(PlaneCurve::kPeano2), "peano2");
}

}  // namespace
}  // namespace hilbrush
