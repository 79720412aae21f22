#include <gtest/gtest.h>

#include "daemon/executor.h"
#include "planner/plan.h"
#include "sim/devices/sim_cell.h"
#include "tests/pipeline/painting.h"

namespace hilbrush {
namespace {

using namespace testing_pipeline;

/// Cell seconds from home to home on the simulated cell.
double painting_s(const ExposureProgram& program, CellDescription description) {
  description.simulation.time_scale = 0;
  SimCell sim(description);
  const Cell cell = sim.cell();
  bring_up(cell);
  Journal journal = Journal::in_memory(program.exposures.size());
  ExecutionControl control;
  std::vector<Joints> approach;
  for (const Via& via : program.vias_before(0)) approach.push_back(via.joints);
  const ExecutionResult result = execute(program, approach, cell, description, journal, control);
  EXPECT_EQ(result.outcome, ExecutionOutcome::kFinished) << result.reason;
  return result.elapsed_s;
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
  const double truth_s = painting_s(painting.program, painting.cell);
  EXPECT_NEAR(estimate.total_s() / truth_s, 1, .02) << estimate.total_s() << " s against " << truth_s << " s";
}

INSTANTIATE_TEST_SUITE_P(AllPlans, Eta,
                         testing::Values(EtaCase{"Fast", Planning::kFast, PosePolicy::kSearch, 30},
                                         EtaCase{"Balanced", Planning::kBalanced, PosePolicy::kSearch, 20},
                                         EtaCase{"Quality", Planning::kQuality, PosePolicy::kSearch, 20},
                                         EtaCase{"Follow", Planning::kBalanced, PosePolicy::kFollowNormal, 20}),
                         [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace hilbrush
