#include "tests/pipeline/random_cells.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <map>

#include "daemon/execution/executor.h"
#include "daemon/pipeline/painted_dots.h"
#include "planner/check/check_cell.h"
#include "planner/check/program_check.h"
#include "planner/plan.h"
#include "sampling/base/input_error.h"
#include "sampling/model/mesh_repair.h"
#include "sampling/place_dots.h"
#include "sim/film/film.h"
#include "tests/pipeline/tick_witness.h"

/// Random cells and objects, through the whole pipeline: each program passes its check, the executed motion
/// keeps all limits and all clearances on every control tick, and every exposure lands on its dot; or the
/// planner says why not.
namespace hilbrush::testing_pipeline {
namespace {

struct Campaign {
  std::size_t works = 0;
  std::size_t without_surface = 0;
  std::size_t without_program = 0;
  std::size_t dots = 0;
  std::size_t exposed = 0;
  std::size_t ticks = 0;
  std::map<std::string, std::size_t> skipped;
  double worst_hit_um = 0;
  double slowest_s = 0;
  double worst_eta = 0;
  std::uint64_t slowest_seed = 0;
};

std::optional<DotSequence> sample(RandomWork& work) {
  try {
    work.mesh = repair_mesh(std::move(work.mesh)).mesh;
    const ToneField tone(work.mesh, ToneOptions{});
    const SurfaceCurve curve(work.mesh);
    SampleOptions options;
    options.dot_count = work.dot_count;
    return place_dots(curve, tone, options);
  } catch (const InputError&) {
    return std::nullopt;  // nothing with area is left
  }
}

void expect_every_dot_has_its_place(const Plan& plan, const DotSequence& dots, Campaign& campaign) {
  EXPECT_EQ(plan.program.exposures.size() + plan.skipped.size(), dots.dots.size());
  for (const SkippedDot& skipped : plan.skipped) {
    EXPECT_FALSE(skipped.detail.empty()) << "dot " << skipped.dot_index;
    ++campaign.skipped[skip_reason_name(skipped.reason)];
  }
}

void expect_painted(const RandomWork& work, const Plan& plan, double pitch_m, Campaign& campaign) {
  CellDescription cell = work.cell;
  cell.simulation.time_scale = 0;
  SimCell sim(cell, {.laser_start_delay_s = 0});
  std::vector<Emission> emissions;
  sim.set_emission_sink([&](const Emission& emission) { emissions.push_back(emission); });
  bring_up(sim.cell());
  const CheckCell check(work.mesh, cell);
  TickWitness witness(sim, cell, [&](const Joints& joints) { return check.body_fault(joints); });
  Journal journal = Journal::in_memory(plan.program.exposures.size());
  ExecutionControl control;
  std::vector<Joints> approach;
  for (const Via& via : plan.program.vias_before(0)) approach.push_back(via.joints);
  const ExecutionResult result = execute(plan.program, approach, witness.cell(), cell, journal, control);
  sim.cell().laser.disable();
  ASSERT_EQ(result.outcome, ExecutionOutcome::kFinished) << result.reason;
  EXPECT_EQ(witness.first_fault(), "");
  campaign.ticks += witness.ticks();
  if (result.elapsed_s > 0)
    campaign.worst_eta = std::max(campaign.worst_eta, std::abs(plan.time.total_s() / result.elapsed_s - 1));

  Film film(work.mesh, cell, pitch_m);
  const PaintedDots painted = match_emissions(plan.program, emissions, film.expose(emissions));
  EXPECT_EQ(painted.exposed, plan.program.exposures.size());
  EXPECT_EQ(painted.hits.off_target, 0u);
  EXPECT_EQ(painted.hits.shadowed, 0u);
  EXPECT_EQ(painted.repeated + painted.foreign + painted.in_doubt, 0u);
  campaign.worst_hit_um = std::max(campaign.worst_hit_um, painted.hits.max_error_um);
}

void run(std::uint64_t seed, Campaign& campaign) {
  RandomWork work = random_work(seed);
  SCOPED_TRACE("seed " + std::to_string(seed) + ", " + work.shape);
  const std::clock_t begin = std::clock();  // CPU time: independent of other work on the machine
  ++campaign.works;
  const auto dots = sample(work);
  if (!dots || dots->dots.empty()) {
    ++campaign.without_surface;
    return;
  }
  const Plan plan = plan_exposures(Reach(work.mesh, work.cell, work.options), *dots);
  for (const ProgramFault& fault :
       check_program(plan.program, plan.skipped, *dots, work.mesh, work.cell, work.options, 3))
    ADD_FAILURE() << "exposure " << fault.exposure << ": " << fault.what;
  expect_every_dot_has_its_place(plan, *dots, campaign);
  if (plan.program.exposures.empty())
    ++campaign.without_program;
  else
    expect_painted(work, plan, dots->pitch_m, campaign);
  campaign.dots += dots->dots.size();
  campaign.exposed += plan.program.exposures.size();
  const double spent_s = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  if (spent_s > campaign.slowest_s) {
    campaign.slowest_s = spent_s;
    campaign.slowest_seed = seed;
  }
}

TEST(RandomCells, EveryProgramPassesItsCheckAndEveryExposureLands) {
  // HILBRUSH_SEED runs this seed only; with HILBRUSH_RANDOM_CELLS this many from there on.
  const char* seed_text = std::getenv("HILBRUSH_SEED");
  const char* count_text = std::getenv("HILBRUSH_RANDOM_CELLS");
  const std::uint64_t first = seed_text ? std::strtoull(seed_text, nullptr, 10) : 1;
  std::uint64_t count = std::getenv("HILBRUSH_LONG") ? 10'000 : 60;
  if (seed_text) count = 1;
  if (count_text) count = std::strtoull(count_text, nullptr, 10);
  Campaign campaign;
  for (std::uint64_t i = 0; i < count; ++i) {
    run(first + i, campaign);
    if (testing::Test::HasFatalFailure()) break;
  }
  std::printf(
      "%zu cells and objects (%zu without a surface, %zu without a program), %zu of %zu dots exposed, worst "
      "hit %.3f "
      "um, %zu control ticks looked at, estimated time off by at most %.2f %%, slowest %.2f CPU s (seed "
      "%llu)\n",
      campaign.works, campaign.without_surface, campaign.without_program, campaign.exposed, campaign.dots,
      campaign.worst_hit_um, campaign.ticks, 100 * campaign.worst_eta, campaign.slowest_s,
      static_cast<unsigned long long>(campaign.slowest_seed));
  for (const auto& [reason, times] : campaign.skipped)
    std::printf("  %zu dots skipped: %s\n", times, reason.c_str());
  if (count >= 60) {
    EXPECT_GT(campaign.exposed, campaign.dots / 4);
    EXPECT_LT(campaign.slowest_s, 60);
  }
}

}  // namespace
}  // namespace hilbrush::testing_pipeline
