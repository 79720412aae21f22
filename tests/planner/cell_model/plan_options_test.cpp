#include "planner/cell_model/plan_options.h"

#include "tests/support/enum_name_table.h"

namespace hilbrush {
namespace {

TEST(PlanOptionNames, NameEachChoiceBothWays) {
  expect_names_both_ways<kPlanningNames>();
  expect_names_both_ways<kOrderNames>();
  expect_names_both_ways<kPolicyNames>();
}

TEST(PlanOptionNames, AreThoseOfJobFiles) {
  EXPECT_STREQ(planning_name(Planning::kBalanced), "balanced");
  EXPECT_STREQ(order_name(DotOrder::kCurve), "curve");
  EXPECT_STREQ(policy_name(PosePolicy::kFollowNormal), "follow_normal");
}

}  // namespace
}  // namespace hilbrush
