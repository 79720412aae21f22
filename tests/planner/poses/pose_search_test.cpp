#include "planner/poses/pose_search.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>

#include "planner/check/program_check.h"
#include "sampling/base/angles.h"
#include "tests/planner/workpieces.h"

namespace hilbrush {
namespace {

struct PlannedCup {
  CellDescription cell = default_cell();
  TexturedMesh mesh = small_cup();
  DotSequence dots = scatter(mesh, 1.1e-3, 5);

  static const PlannedCup& get() {
    static const PlannedCup cup;
    return cup;
  }
  Plan plan(const PlanOptions& options) const { return plan_exposures(Reach(mesh, cell, options), dots); }
  void expect_sound(const Plan& plan, const PlanOptions& options) const {
    for (const auto& fault : check_program(plan.program, plan.skipped, dots, mesh, cell, options))
      ADD_FAILURE() << "exposure " << fault.exposure << ": " << fault.what;
  }
};

double mean_incidence(const Plan& plan) {
  double sum = 0;
  for (const Exposure& exposure : plan.program.exposures) sum += static_cast<double>(exposure.incidence);
  return sum / static_cast<double>(plan.program.exposures.size());
}

std::size_t table_moves(const Plan& plan) {
  std::size_t moves = 0;
  const auto& exposures = plan.program.exposures;
  for (std::size_t i = 1; i < exposures.size(); ++i)
    if (exposures[i].joints[kTilt] != exposures[i - 1].joints[kTilt] ||
        exposures[i].joints[kRotation] != exposures[i - 1].joints[kRotation])
      ++moves;
  return moves;
}

TEST(PoseSearch, QualityCostsTimeAndSparesIncidence) {
  const auto& cup = PlannedCup::get();
  const PlanOptions fast{.planning = Planning::kFast}, balanced{.planning = Planning::kBalanced},
      quality{.planning = Planning::kQuality};
  const Plan fast_plan = cup.plan(fast), balanced_plan = cup.plan(balanced), quality_plan = cup.plan(quality);
  cup.expect_sound(fast_plan, fast);
  cup.expect_sound(balanced_plan, balanced);
  cup.expect_sound(quality_plan, quality);
  EXPECT_LT(mean_incidence(quality_plan), .9 * mean_incidence(balanced_plan));
  EXPECT_LE(mean_incidence(balanced_plan), 1.05 * mean_incidence(fast_plan));
  EXPECT_LE(fast_plan.time.total_s(), 1.05 * balanced_plan.time.total_s());
  EXPECT_LT(balanced_plan.time.total_s(), quality_plan.time.total_s());
}

TEST(PoseSearch, BeatsTheTableThatFollowsTheNormal) {
  const auto& cup = PlannedCup::get();
  const PlanOptions follow{.policy = PosePolicy::kFollowNormal};
  const Plan followed = cup.plan(follow), searched = cup.plan({});
  cup.expect_sound(followed, follow);
  EXPECT_GT(static_cast<double>(table_moves(followed)), .95 * static_cast<double>(cup.dots.dots.size()));
  EXPECT_LT(table_moves(searched), cup.dots.dots.size() / 20);
  EXPECT_LT(searched.time.total_s(), followed.time.total_s() / 2);
  EXPECT_EQ(searched.skipped.size(), followed.skipped.size());
}

TEST(PoseSearch, TheBaselineMeetsDotsHeadOnWhereItCan) {
  const CellDescription cell = default_cell();
  const TexturedMesh mesh = ball(.025);
  DotSequence dots = scatter(mesh, 1.5e-3);
  std::erase_if(dots.dots, [](const Dot& dot) { return dot.smooth_normal_O.z() < .1F; });
  const PlanOptions follow{.policy = PosePolicy::kFollowNormal};
  const Plan plan = plan_exposures(Reach(mesh, cell, follow), dots);
  ASSERT_EQ(plan.program.exposures.size(), dots.dots.size());
  const Kinematics kinematics(cell);
  for (const Exposure& exposure : plan.program.exposures) {
    const Eigen::Vector3d normal_O =
        dots.dots[exposure.dot_index].smooth_normal_O.cast<double>().normalized();
    EXPECT_LT((kinematics.tool_pose(exposure.joints).beam_O + normal_O).norm(), 1e-6);
  }
}

TEST(PoseSearch, ImprovedOrderIsFasterThanTheCurve) {
  const auto& cup = PlannedCup::get();
  const PlanOptions curve{.order = DotOrder::kCurve};
  const Plan along = cup.plan(curve), improved = cup.plan({});
  cup.expect_sound(along, curve);
  EXPECT_LT(improved.time.total_s(), along.time.total_s());
}

TEST(PoseSearch, PreferredIncidenceIsKeptWhereItCanBe) {
  const auto& cup = PlannedCup::get();
  const Kinematics kinematics(cup.cell);
  for (const double preferred_deg : {0., 5., 12., 30.}) {
    const PlanOptions options{.preferred_incidence = preferred_deg * kDegree};
    const Reach reach(cup.mesh, cup.cell, options);
    const Plan plan = plan_exposures(reach, cup.dots);
    cup.expect_sound(plan, options);
    for (const Exposure& exposure : plan.program.exposures) {
      const Dot& dot = cup.dots.dots[exposure.dot_index];
      const Eigen::Vector3d normal_O = dot.smooth_normal_O.cast<double>().normalized();
      const double from_smooth =
          std::acos(std::min(1., -kinematics.tool_pose(exposure.joints).beam_O.dot(normal_O)));
      if (from_smooth <= std::max(options.preferred_incidence, 5 * kDegree) + 1e-6) continue;
      // Only where the search for a single pose, which prefers small angles, finds none within it either.
      const auto pose = reach.find_pose(target_of(dot), home_joints(cup.cell)).pose;
      ASSERT_TRUE(pose);
      EXPECT_GT(pose->from_smooth, from_smooth - 5 * kDegree) << "preferred " << preferred_deg;
    }
  }
}

TEST(PoseSearch, SameBytesForAnyNumberOfThreads) {
  const auto& cup = PlannedCup::get();
  for (const Planning planning : {Planning::kFast, Planning::kQuality}) {
    const PlanOptions options{.planning = planning};
    const Plan many = cup.plan(options);
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const Plan single = cup.plan(options);
    ASSERT_EQ(single.program.exposures.size(), many.program.exposures.size());
    ASSERT_EQ(single.program.vias.size(), many.program.vias.size());
    for (std::size_t i = 0; i < many.program.exposures.size(); ++i) {
      ASSERT_EQ(single.program.exposures[i].dot_index, many.program.exposures[i].dot_index)
          << "exposure " << i;
      ASSERT_EQ(std::memcmp(single.program.exposures[i].joints.data(),
                            many.program.exposures[i].joints.data(), sizeof(Joints)),
                0)
          << "exposure " << i;
    }
  }
}

TEST(PoseSearch, FewDotsAndOddOnes) {
  const auto& cup = PlannedCup::get();
  const Reach reach(cup.mesh, cup.cell, {});
  for (const std::size_t count : {0U, 1U, 2U, 3U, 7U}) {
    DotSequence few;
    few.pitch_m = cup.dots.pitch_m;
    few.dots.assign(cup.dots.dots.begin(), cup.dots.dots.begin() + static_cast<std::ptrdiff_t>(count));
    const Plan plan = plan_exposures(reach, few);
    EXPECT_EQ(plan.program.exposures.size(), count);
  }
  DotSequence inside;  // dots within the wall: nothing reaches them, and each says why
  inside.pitch_m = cup.dots.pitch_m;
  for (int i = 0; i < 50; ++i) {
    Dot dot;
    dot.position_O = {.001 * i / 50, .0001, .01};
    dot.normal_O = dot.smooth_normal_O = {0, 0, 1};
    inside.dots.push_back(dot);
  }
  const Plan none = plan_exposures(reach, inside);
  EXPECT_TRUE(none.program.exposures.empty());
  ASSERT_EQ(none.skipped.size(), 50U);
  for (const SkippedDot& skipped : none.skipped) EXPECT_FALSE(skipped.detail.empty());
}

TEST(PoseSearch, J4AndCStayWithinTheirTurns) {
  // Many stations one after another: C winds on, J4 must not run into its ends within any of them.
  const auto& cup = PlannedCup::get();
  CellDescription cell = cup.cell;
  cell.axes[kRotation].min = -200 * kDegree;
  cell.axes[kRotation].max = 200 * kDegree;
  cell.axes[kJ4].min = -190 * kDegree;
  cell.axes[kJ4].max = 190 * kDegree;
  const Plan plan = plan_exposures(Reach(cup.mesh, cell, {}), cup.dots);
  for (const auto& fault : check_program(plan.program, plan.skipped, cup.dots, cup.mesh, cell, {}))
    ADD_FAILURE() << "exposure " << fault.exposure << ": " << fault.what;
  EXPECT_GT(static_cast<double>(plan.program.exposures.size()),
            .95 * static_cast<double>(cup.dots.dots.size()));
}

}  // namespace
}  // namespace hilbrush
