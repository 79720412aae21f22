#include "planner/mounting.h"

#include <gtest/gtest.h>

#include <numbers>

#include "tests/planner/workpieces.h"

namespace hilbrush {
namespace {

TEST(Mounting, NothingSetChangesNothing) {
  const CellDescription cell = default_cell(), same = with_fixture(cell, {});
  EXPECT_EQ(same.fixture.post_height_m, cell.fixture.post_height_m);
  EXPECT_EQ(same.fixture.post_radius_m, cell.fixture.post_radius_m);
  EXPECT_EQ(same.table.plate_radius_m, cell.table.plate_radius_m);
  EXPECT_EQ(mounted(ball(.02), {}).vertices, ball(.02).vertices);
}

TEST(Mounting, TheFixtureIsTheJobs) {
  const CellDescription cell = with_fixture(
      default_cell(),
      {.post_height_m = .08, .post_radius_m = .004, .plate_radius_m = .05, .offset_m = {}, .turn = 0});
  EXPECT_EQ(cell.fixture.post_height_m, .08);
  EXPECT_EQ(cell.fixture.post_radius_m, .004);
  EXPECT_EQ(cell.table.plate_radius_m, .05);
  EXPECT_EQ(cell.sha256, default_cell().sha256);
}

TEST(Mounting, TheObjectIsTurnedThenShifted) {
  TexturedMesh mesh;
  mesh.vertices = {{.01, 0, .02}, {0, .03, 0}};
  const TexturedMesh moved = mounted(mesh, {.post_height_m = {},
                                            .post_radius_m = {},
                                            .plate_radius_m = {},
                                            .offset_m = {.001, .002, .003},
                                            .turn = std::numbers::pi / 2});
  EXPECT_LT((moved.vertices[0] - Eigen::Vector3d(.001, .012, .023)).norm(), 1e-15);
  EXPECT_LT((moved.vertices[1] - Eigen::Vector3d(-.029, .002, .003)).norm(), 1e-15);
}

}  // namespace
}  // namespace hilbrush
