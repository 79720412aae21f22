#include "planner/plan.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <cstring>

#include "planner/cell_model/dose.h"
#include "planner/cell_model/time_model.h"
#include "planner/check/check_cell.h"
#include "planner/check/program_check.h"
#include "planner/reach/reach.h"
#include "planner/reach/transit.h"
#include "sampling/base/angles.h"
#include "sampling/base/input_error.h"
#include "tests/planner/workpieces.h"

namespace hilbrush {
namespace {

/// What several tests look at, planned once.
struct PlannedBall {
  CellDescription cell = default_cell();
  PlanOptions options;
  TexturedMesh mesh = ball(.025);
  DotSequence dots = scatter(mesh, .8e-3);
  Reach reach{mesh, cell, options};
  Plan plan = plan_exposures(reach, dots);

  static const PlannedBall& get() {
    static const PlannedBall planned;
    return planned;
  }
};

TEST(Plan, EveryDotIsExposedOrSkippedWithAReason) {
  const auto& [cell, options, mesh, dots, reach, plan] = PlannedBall::get();
  std::vector<int> seen(dots.dots.size(), 0);
  for (const Exposure& exposure : plan.program.exposures) ++seen.at(exposure.dot_index);
  for (const SkippedDot& skipped : plan.skipped) {
    ++seen.at(skipped.dot_index);
    EXPECT_FALSE(skipped.detail.empty());
  }
  EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), static_cast<std::ptrdiff_t>(seen.size()));
  EXPECT_GT(static_cast<double>(plan.program.exposures.size()), .99 * static_cast<double>(dots.dots.size()));
}

TEST(Plan, IncidenceIsPreferredMostlyAndNeverExceedsItsLimit) {
  const auto& [cell, options, mesh, dots, reach, plan] = PlannedBall::get();
  const Kinematics kinematics(cell);
  std::size_t preferred = 0;
  for (const Exposure& exposure : plan.program.exposures) {
    const Dot& dot = dots.dots[exposure.dot_index];
    const ToolPose tool = kinematics.tool_pose(exposure.joints);
    ASSERT_LT((tool.focus_O - dot.position_O).norm(), 1e-9);
    const double face = std::acos(-tool.beam_O.dot(dot.normal_O.cast<double>().normalized()));
    const double smooth = std::acos(-tool.beam_O.dot(dot.smooth_normal_O.cast<double>().normalized()));
    EXPECT_LE(face, options.max_incidence);
    EXPECT_NEAR(face, exposure.incidence, 1e-3);
    EXPECT_TRUE(kinematics.limit_excess(exposure.joints).is_inside());
    if (smooth <= options.preferred_incidence + 1e-6) ++preferred;
  }
  // Only a cap around the post needs more.
  EXPECT_GT(static_cast<double>(preferred), .9 * static_cast<double>(plan.program.exposures.size()));
}

TEST(Plan, TheTableHoldsStillForMostDots) {
  const auto& [cell, options, mesh, dots, reach, plan] = PlannedBall::get();
  const auto& exposures = plan.program.exposures;
  std::size_t moved = 0;
  for (std::size_t i = 1; i < exposures.size(); ++i)
    if (exposures[i].joints[kTilt] != exposures[i - 1].joints[kTilt] ||
        exposures[i].joints[kRotation] != exposures[i - 1].joints[kRotation])
      ++moved;
  EXPECT_LT(moved, exposures.size() / 10);
}

TEST(Plan, PassesItsIndependentCheck) {
  const auto& [cell, options, mesh, dots, reach, plan] = PlannedBall::get();
  for (const auto& fault : check_program(plan.program, plan.skipped, dots, mesh, cell, options))
    ADD_FAILURE() << "exposure " << fault.exposure << ": " << fault.what;
}

TEST(Plan, ACupIsPaintedInsideOutsideAndBelow) {
  const CellDescription cell = default_cell();
  const TexturedMesh mesh = small_cup();
  const DotSequence dots = scatter(mesh, 1e-3);
  const Reach reach(mesh, cell, {});
  const Plan plan = plan_exposures(reach, dots);
  EXPECT_GT(static_cast<double>(plan.program.exposures.size()), .99 * static_cast<double>(dots.dots.size()));
  std::size_t below = 0;
  std::size_t inside = 0;
  for (const Exposure& exposure : plan.program.exposures) {
    if (exposure.position_O.z() < 1e-6) ++below;
    if (exposure.position_O.z() > .03 && exposure.position_O.dot(exposure.normal_O.cast<double>()) < 0)
      ++inside;
  }
  EXPECT_GT(below, 500U);
  EXPECT_GT(inside, 100U);
  for (const auto& fault : check_program(plan.program, plan.skipped, dots, mesh, cell, {}))
    ADD_FAILURE() << "exposure " << fault.exposure << ": " << fault.what;
}

TEST(Plan, SameBytesForAnyNumberOfThreads) {
  const auto& [cell, options, mesh, dots, reach, plan] = PlannedBall::get();
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const Plan again = plan_exposures(Reach(mesh, cell, options), dots);
  ASSERT_EQ(again.program.exposures.size(), plan.program.exposures.size());
  ASSERT_EQ(again.program.vias.size(), plan.program.vias.size());
  for (std::size_t i = 0; i < again.program.exposures.size(); ++i)
    ASSERT_EQ(std::memcmp(again.program.exposures[i].joints.data(), plan.program.exposures[i].joints.data(),
                          sizeof(Joints)),
              0)
        << "exposure " << i;
  for (std::size_t i = 0; i < again.program.vias.size(); ++i)
    ASSERT_EQ(again.program.vias[i].joints, plan.program.vias[i].joints) << "way-point " << i;
}

TEST(Plan, TimeIsTheSumOfItsMoves) {
  const auto& [cell, options, mesh, dots, reach, plan] = PlannedBall::get();
  const auto count = static_cast<double>(plan.program.exposures.size());
  EXPECT_NEAR(plan.time.expose_s, count * cell.laser.pulse_s, 1e-3 * count * cell.laser.pulse_s);
  EXPECT_GE(plan.time.settle_s, count * cell.timing.settle_min_s);
  EXPECT_LE(plan.time.settle_s, count * cell.timing.settle_max_s);
  EXPECT_LT(plan.time.total_s() / count, .08) << "seconds a dot";
}

TEST(Plan, NoDotsNoExposures) {
  const auto& planned = PlannedBall::get();
  DotSequence none;
  none.pitch_m = 1e-3;
  const Plan plan = plan_exposures(planned.reach, none);
  EXPECT_TRUE(plan.program.exposures.empty());
  EXPECT_TRUE(plan.skipped.empty());
  EXPECT_TRUE(
      check_program(plan.program, plan.skipped, none, planned.mesh, planned.cell, planned.options).empty());
}

TEST(Plan, ProgressReachesOneAndMayEndThePlan) {
  const auto& planned = PlannedBall::get();
  double last = 0;
  plan_exposures(planned.reach, planned.dots, [&](double fraction) {
    EXPECT_GE(fraction, last);
    last = fraction;
  });
  EXPECT_EQ(last, 1);
  EXPECT_THROW(
      plan_exposures(planned.reach, planned.dots, [](double) { throw std::runtime_error("enough"); }),
      std::runtime_error);
}

TEST(Plan, TooMuchEnergyIsSkippedWithAReason) {
  const auto& planned = PlannedBall::get();
  DotSequence dots;
  dots.pitch_m = planned.dots.pitch_m;
  dots.dots.assign(planned.dots.dots.begin(), planned.dots.dots.begin() + 500);
  CellDescription cell = planned.cell;
  cell.laser.power_max_w = 1e-3;
  const double most_j = cell.laser.power_max_w * cell.laser.pulse_max_s;
  dots.dots[499].level = static_cast<float>(1.5 * most_j / full_energy_j(cell, dots.pitch_m));
  for (std::size_t i = 0; i < 499; ++i)
    dots.dots[i].level = static_cast<float>(.2 * most_j / full_energy_j(cell, dots.pitch_m));
  const Plan plan = plan_exposures(Reach(planned.mesh, cell, planned.options), dots);
  const auto it = std::find_if(plan.skipped.begin(), plan.skipped.end(),
                               [](const SkippedDot& skipped) { return skipped.dot_index == 499; });
  ASSERT_NE(it, plan.skipped.end());
  EXPECT_EQ(it->reason, SkipReason::kEnergy);
  EXPECT_NE(it->detail.find("mJ"), std::string::npos);
}

TEST(Dose, PowerAndPulseStayWithinTheLaser) {
  const CellDescription cell = default_cell();
  const double pitch_m = .0254 / 100;
  const double full_j = full_energy_j(cell, pitch_m);
  const auto& laser = cell.laser;
  for (double energy_j = laser.power_min_w * laser.pulse_min_s * 1.0001;
       energy_j < laser.power_max_w * laser.pulse_max_s; energy_j *= 1.3) {
    const auto dose = find_dose(cell, pitch_m, energy_j / full_j).dose;
    ASSERT_TRUE(dose.has_value()) << energy_j;
    EXPECT_NEAR(static_cast<double>(dose->power_w) * static_cast<double>(dose->pulse_s) / energy_j, 1, 1e-6);
    EXPECT_LE(dose->power_w, static_cast<float>(laser.power_max_w));
    EXPECT_GE(dose->power_w, static_cast<float>(laser.power_min_w));
    EXPECT_LE(dose->pulse_s, static_cast<float>(laser.pulse_max_s));
    EXPECT_GE(dose->pulse_s, static_cast<float>(laser.pulse_min_s));
    const double power_w = energy_j / laser.pulse_s;
    if (power_w > laser.power_min_w && power_w < laser.power_max_w) {
      EXPECT_EQ(dose->pulse_s, static_cast<float>(laser.pulse_s));
    }
  }
  for (const double level : {0., -1., std::nan(""), 1e9}) {
    const DoseResult result = find_dose(cell, pitch_m, level);
    EXPECT_FALSE(result.dose.has_value()) << level;
    EXPECT_FALSE(result.refusal.empty());
  }
}

/// Where the axes rest if they are stopped `time_s` into a move: each brakes by itself.
Joints stopped_at(const CellDescription& cell, const Joints& from, const Joints& to, double time_s) {
  constexpr double kStep = 1e-6;
  const Joints a = joints_during(cell, from, to, time_s);
  const Joints b = joints_during(cell, from, to, time_s + kStep);
  Joints rest = a;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const double speed = (b[i] - a[i]) / kStep;
    rest[i] += std::copysign(speed * speed / (2 * cell.axes[i].acceleration_max), speed);
  }
  return rest;
}

TEST(Approach, IsClearFromWhereverTheCellWasStopped) {
  const auto& [cell, options, mesh, dots, reach, plan] = PlannedBall::get();
  const CheckCell check_cell(mesh, cell);
  const auto& exposures = plan.program.exposures;
  std::mt19937 random(31);
  std::uniform_real_distribution<double> share(0, 1);
  for (int n = 0; n < 300; ++n) {
    const std::size_t i = 1 + random() % (exposures.size() - 1);
    std::vector<Joints> path{exposures[i - 1].joints};
    for (const Via& via : plan.program.vias_before(i)) path.push_back(via.joints);
    path.push_back(exposures[i].joints);
    const std::size_t leg = 1 + random() % (path.size() - 1);
    const Joints from =
        stopped_at(cell, path[leg - 1], path[leg], share(random) * move_s(cell, path[leg - 1], path[leg]));

    std::vector<Joints> back{from};
    ASSERT_NO_THROW({
      for (const Joints& via : plan_approach(reach, plan.program, i, from)) back.push_back(via);
    }) << "stop "
       << n << " before exposure " << i;
    back.push_back(exposures[i].joints);
    for (std::size_t k = 1; k < back.size(); ++k)
      for (double t = 0; t <= 1; t += .01) {
        const Joints at = joints_during(cell, back[k - 1], back[k], t * move_s(cell, back[k - 1], back[k]));
        ASSERT_EQ(check_cell.body_fault(check_cell.X_OF(at)), "") << "stop " << n << " before exposure " << i;
      }
  }
}

TEST(Approach, FromHomeAndFromNonsense) {
  const auto& [cell, options, mesh, dots, reach, plan] = PlannedBall::get();
  EXPECT_NO_THROW(plan_approach(reach, plan.program, 0, home_joints(cell)));
  Joints outside = home_joints(cell);
  outside[kJ1] = 4;
  EXPECT_THROW(plan_approach(reach, plan.program, 0, outside), InputError);
  outside[kJ1] = std::nan("");
  EXPECT_THROW(plan_approach(reach, plan.program, 0, outside), InputError);
  EXPECT_THROW(plan_approach(reach, plan.program, plan.program.exposures.size(), home_joints(cell)),
               InputError);
  // A pose in which the lens is inside the ball: a path out of it is not guaranteed.
  const Kinematics kinematics(cell);
  Joints inside = home_joints(cell);
  const TablePose table = kinematics.table_pose(0, 0);
  ASSERT_TRUE(kinematics.solve_arm(table.to_W({.07, 0, -.04}), 0, Elbow::kPositive, inside));
  EXPECT_THROW(plan_approach(reach, plan.program, 0, inside), InputError);
}

}  // namespace
}  // namespace hilbrush
