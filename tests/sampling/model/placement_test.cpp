#include "sampling/model/placement.h"

#include <gtest/gtest.h>

#include "sampling/base/input_error.h"

namespace hilbrush {
namespace {

/// One triangle in the y-z plane of a file whose y points up: 3 high, 4 deep, 0 wide, away from the origin.
Model slanted() {
  Model model;
  model.mesh.vertices = {{10, 5, 1}, {10, 8, 1}, {10, 5, 5}};
  model.mesh.triangles = {{0, 1, 2}};
  model.mesh.corner_uv.resize(1);
  model.mesh.corner_luminance.resize(1);
  model.mesh.material_index = {0};
  model.mesh.materials.resize(1);
  model.up = UpAxis::kY;
  return model;
}

std::string refusal(const Model& model, const PlacementOptions& options) {
  try {
    place_on_table(model, options);
  } catch (const InputError& error) {
    return error.sentence();
  }
  return "";
}

TEST(Placement, StandsTheObjectUprightOnTheTableCenteredOnTheAxis) {
  Model model = slanted();
  model.unit_m = .01;
  const TexturedMesh mesh = place_on_table(model, {});
  const auto [low, high] = bounds(mesh);
  EXPECT_LT((low - Eigen::Vector3d(0, -.02, 0)).norm(), 1e-12);
  EXPECT_LT((high - Eigen::Vector3d(0, .02, .03)).norm(), 1e-12);
  EXPECT_LT((mesh.vertices[1] - Eigen::Vector3d(0, .02, .03)).norm(), 1e-12)
      << "the file's -z is the table's +y: turned, not mirrored";
}

TEST(Placement, ScalesTheLongestSide) {
  const TexturedMesh mesh = place_on_table(slanted(), {.size_m = .08});
  const auto [low, high] = bounds(mesh);
  EXPECT_NEAR((high - low).maxCoeff(), .08, 1e-12);
}

TEST(Placement, UsesTheUpAxisThatIsGiven) {
  const TexturedMesh mesh = place_on_table(slanted(), {.unit_m = .001, .up = UpAxis::kZ});
  EXPECT_NEAR(bounds(mesh)[1].z(), .004, 1e-12);
}

TEST(Placement, RefusesWhatItCannotKnow) {
  const std::string sentence = refusal(slanted(), {});
  EXPECT_NE(sentence.find("--size-mm"), std::string::npos);
  EXPECT_NE(sentence.find("--units-mm"), std::string::npos);
  EXPECT_NE(refusal(slanted(), {.size_m = .08, .unit_m = .001}).find("contradict"), std::string::npos);
  EXPECT_EQ(refusal(slanted(), {.size_m = .08, .unit_m = .02}), "") << "both, but they agree";
  EXPECT_NE(refusal(slanted(), {.size_m = 0}).find("more than 0"), std::string::npos);
  EXPECT_NE(refusal(slanted(), {.unit_m = 1}).find("more than 2000 mm"), std::string::npos);
  EXPECT_NE(refusal(slanted(), {.unit_m = -1}).find("more than 0"), std::string::npos);
  Model point = slanted();
  point.mesh.vertices = {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}};
  EXPECT_NE(refusal(point, {.size_m = 1}).find("no extent"), std::string::npos);
}

}  // namespace
}  // namespace hilbrush
