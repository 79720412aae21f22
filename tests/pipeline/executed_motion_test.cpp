#include <gtest/gtest.h>

#include "config/cell_file.h"
#include "daemon/execution/executor.h"
#include "daemon/pipeline/pipeline.h"
#include "planner/cell_model/program_file.h"
#include "planner/check/check_cell.h"
#include "sampling/images/image_file.h"
#include "sampling/model/mesh_repair.h"
#include "sampling/model/placement.h"
#include "tests/pipeline/painting.h"
#include "tests/pipeline/tick_witness.h"
#include "tests/support/temporary_folder.h"

/// A real job's motion as the simulated cell's axes really run it, looked at on every control tick.
namespace hilbrush::testing_pipeline {
namespace {

TEST(ExecutedMotion, KeepsLimitsAndClearanceOnEveryTick) {
  const testing_support::TemporaryFolder folder;
  JobSettings settings;
  settings.dpi.reset();
  settings.dots = 1500;
  settings.size_mm = 60;
  const PipelineRequest request{test_data("eggcup.wrl"), settings, find_cell("default"), folder.path()};
  run_plan(request, {});
  const ExposureProgram program = read_program(folder.path() / "program.ply");
  ASSERT_EQ(program.exposures.size(), 1500u);
  CellDescription description = load_cell(request.cell_file);
  description.simulation.time_scale = 0;

  PlacementOptions placement;
  placement.size_m = .06;
  const TexturedMesh mesh =
      repair_mesh(place_on_table(load_model(request.model, load_image_file), placement)).mesh;
  const CheckCell check(mesh, description);
  SimCell sim(description, {.laser_start_delay_s = 0});
  bring_up(sim.cell());
  TickWitness witness(sim, description, [&](const Joints& joints) { return check.body_fault(joints); });
  Journal journal = Journal::in_memory(program.exposures.size());
  ExecutionControl control;
  std::vector<Joints> approach;
  for (const Via& via : program.vias_before(0)) approach.push_back(via.joints);
  const ExecutionResult result = execute(program, approach, witness.cell(), description, journal, control);
  EXPECT_EQ(result.outcome, ExecutionOutcome::kFinished) << result.reason;
  EXPECT_EQ(witness.first_fault(), "");
  EXPECT_GT(witness.ticks(), 10 * program.exposures.size());
}

/// The witness itself: it sees an axis that is too fast for the limits that it has.
TEST(ExecutedMotion, TheWitnessSeesWhatBreaksALimit) {
  CellDescription description = load_cell(find_cell("default"));
  description.simulation.time_scale = 0;
  const auto fault_with = [&](const std::function<void(CellDescription&)>& tighten) {
    SimCell sim(description, {.laser_start_delay_s = 0});
    bring_up(sim.cell());
    CellDescription tighter = description;
    tighten(tighter);
    TickWitness witness(sim, tighter);
    Joints away;
    for (std::size_t i = 0; i < kAxisCount; ++i)
      away[i] = .5 * (description.axes[i].home + description.axes[i].max);
    ExecutionControl control;
    const ExecutionResult result = travel({away}, witness.cell(), description, control);
    EXPECT_EQ(result.outcome, ExecutionOutcome::kFinished) << result.reason;
    return witness.first_fault();
  };
  EXPECT_EQ(fault_with([](CellDescription&) {}), "");
  EXPECT_TRUE(
      fault_with([](CellDescription& c) { c.axes[kJ2].speed_max *= .99; }).starts_with("j2 is faster"));
  EXPECT_TRUE(fault_with([](CellDescription& c) {
                c.axes[kTilt].acceleration_max *= .9;
              }).starts_with("a accelerates"));
  EXPECT_TRUE(
      fault_with([](CellDescription& c) { c.axes[kRotation].max = .01; }).starts_with("c is outside"));
}

}  // namespace
}  // namespace hilbrush::testing_pipeline
