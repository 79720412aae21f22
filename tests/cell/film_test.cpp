#include "sim/film/film.h"

#include <gtest/gtest.h>

#include "config/cell_file.h"
#include "daemon/pipeline/pipeline.h"
#include "planner/cell_model/program_file.h"
#include "sampling/images/image_file.h"
#include "sampling/model/model_file.h"
#include "sampling/model/placement.h"
#include "sim/devices/sim_cell.h"
#include "tests/cell/wired_world.h"
#include "tests/cell/witness.h"

/// The main job from model to film, once on the cell in process and once through the real drivers over the
/// wire.
namespace hilbrush {
namespace {

using test::painted_in_process;
using test::WiredWorld;

std::vector<Emission> painted_on_wire(const ExposureProgram& program) {
  WiredWorld world(WiredWorld::quick(.02));
  ExecutionControl control;
  world.recover(control);
  Journal journal = Journal::in_memory(program.exposures.size());
  const auto result = execute(program, {}, world.cell(), world.description, journal, control);
  EXPECT_EQ(result.outcome, ExecutionOutcome::kFinished) << result.reason;
  EXPECT_EQ("", test::broken_invariants(program, journal, world.emissions()));
  return world.emissions();
}

TEST(FilmOfTheWireTest, TheEggCupIsHitWhereItIsInProcess) {
  const std::filesystem::path model = std::filesystem::path(HILBRUSH_SOURCE_DIR) / "tests/data/eggcup.wrl";
  const testing_support::TemporaryFolder folder;
  JobSettings settings;
  settings.size_mm = 10;
  settings.dpi = 100;
  run_plan({model, settings, find_cell("default"), folder.path()}, {});
  ExposureProgram program = read_program(folder.path() / "program.ply");
  constexpr std::size_t kPainted = 300;
  ASSERT_GT(program.exposures.size(), kPainted);
  program.exposures.resize(kPainted);
  std::erase_if(program.vias, [](const Via& via) { return via.before_exposure >= kPainted; });
  const CellDescription description = test::shipped_cell();
  const auto in_process = painted_in_process(program, description);
  const auto on_wire = painted_on_wire(program);
  ASSERT_EQ(on_wire.size(), in_process.size());

  PlacementOptions placement;
  placement.size_m = *settings.size_mm * 1e-3;
  const TexturedMesh mesh = place_on_table(load_model(model, load_image_file), placement);
  Film one(mesh, description, program.pitch_m), other(mesh, description, program.pitch_m);
  const auto hits = one.expose(in_process);
  const auto others = other.expose(on_wire);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    ASSERT_TRUE(hits[i].is_hit && others[i].is_hit) << "exposure " << i;
    EXPECT_LT((hits[i].position_O - others[i].position_O).norm(), 10e-6) << "exposure " << i;
    EXPECT_NEAR(on_wire[i].power_w * on_wire[i].length_s, in_process[i].power_w * in_process[i].length_s,
                1e-4 * in_process[i].power_w * in_process[i].length_s)
        << "exposure " << i;
  }
}

}  // namespace
}  // namespace hilbrush
