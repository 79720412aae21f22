#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "config/cell_file.h"
#include "daemon/execution/executor.h"
#include "planner/plan.h"
#include "sim/devices/sim_cell.h"
#include "tests/pipeline/painting.h"

namespace hilbrush {
namespace {

using namespace testing_pipeline;

/// From home to home on the simulated cell; `truth` is what it is, `description` what it is thought to be.
ExecutionResult painted(const ExposureProgram& program, const CellDescription& description,
                        CellDescription truth) {
  truth.simulation.time_scale = 0;
  SimCell sim(truth);
  const Cell cell = sim.cell();
  bring_up(cell);
  Journal journal = Journal::in_memory(program.exposures.size());
  ExecutionControl control;
  std::vector<Joints> approach;
  for (const Via& via : program.vias_before(0)) approach.push_back(via.joints);
  ExecutionResult result = execute(program, approach, cell, description, journal, control);
  EXPECT_EQ(result.outcome, ExecutionOutcome::kFinished) << result.reason;
  return result;
}

/// A cell file with what was measured.
CellDescription with_measured(const MeasuredMotion& motion) {
  std::ifstream file(find_cell("default"));
  nlohmann::json json = nlohmann::json::parse(file);
  json["measured"]["move_delay_ms"] = 1e3 * motion.move_delay_s;
  for (std::size_t i = 0; i < kAxisCount; ++i)
    if (motion.time_factor[i]) json["measured"]["time_factor"][kAxisNames[i]] = *motion.time_factor[i];
  return cell_from_json(json.dump(), "measured.json");
}

struct EtaCase {
  const char* name;
  Planning planning;
  PosePolicy policy;
  double dpi;
};

class Eta : public testing::TestWithParam<EtaCase> {};

TEST_P(Eta, IsWhatTheSimulatedCellThenTakesWithinTwoPercent) {
  JobSettings settings;
  settings.dpi = GetParam().dpi;
  settings.size_mm = 60;
  settings.planning = GetParam().planning;
  settings.policy = GetParam().policy;
  const Painting painting = paint_model(test_data("eggcup.wrl"), settings);
  const TimeSplit estimate = estimate_time(painting.cell, painting.program);
  const double truth_s = painted(painting.program, painting.cell, painting.cell).elapsed_s;
  EXPECT_NEAR(estimate.total_s() / truth_s, 1, .02) << estimate.total_s() << " s against " << truth_s << " s";
}

INSTANTIATE_TEST_SUITE_P(AllPlans, Eta,
                         testing::Values(EtaCase{"Fast", Planning::kFast, PosePolicy::kSearch, 30},
                                         EtaCase{"Balanced", Planning::kBalanced, PosePolicy::kSearch, 20},
                                         EtaCase{"Quality", Planning::kQuality, PosePolicy::kSearch, 20},
                                         EtaCase{"Follow", Planning::kBalanced, PosePolicy::kFollowNormal,
                                                 20}),
                         [](const auto& tested) { return std::string(tested.param.name); });

TEST(MeasuredMotion, OfTheCellThatItIsThoughtToBeIsNothing) {
  JobSettings settings;
  settings.dpi = 15;
  settings.size_mm = 60;
  const Painting painting = paint_model(test_data("eggcup.wrl"), settings);
  const auto measured = painted(painting.program, painting.cell, painting.cell).motion.measured();
  ASSERT_TRUE(measured);
  EXPECT_NEAR(measured->move_delay_s, 0, 1e-4);
  EXPECT_TRUE(measured->time_factor[kJ3]);
  for (const auto& factor : measured->time_factor) EXPECT_NEAR(factor.value_or(1), 1, .01);
}

TEST(MeasuredMotion, OfASlowerCellMakesTheEstimateTrue) {
  JobSettings settings;
  settings.dpi = 20;
  settings.size_mm = 60;
  const Painting painting = paint_model(test_data("eggcup.wrl"), settings);
  CellDescription slow = painting.cell;
  for (AxisDescription& axis : slow.axes) axis.speed_max *= .7, axis.acceleration_max *= .4;
  const ExecutionResult result = painted(painting.program, painting.cell, slow);
  EXPECT_LT(estimate_time(painting.cell, painting.program).total_s() / result.elapsed_s, .95);
  const auto measured = result.motion.measured();
  ASSERT_TRUE(measured);
  const double estimate_s = estimate_time(with_measured(*measured), painting.program).total_s();
  EXPECT_NEAR(estimate_s / result.elapsed_s, 1, .02)
      << estimate_s << " s against " << result.elapsed_s << " s";
}

}  // namespace
}  // namespace hilbrush
