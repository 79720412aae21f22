#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "sampling/curve/patches.h"
#include "sampling/curve/surface_curve.h"
#include "sampling/model/mesh_repair.h"
#include "sampling/model/model_file.h"
#include "sampling/model/placement.h"
#include "sampling/place_dots.h"

namespace hilbrush {
namespace {

class RealSurface : public testing::TestWithParam<const char*> {};

TEST_P(RealSurface, IsMappedAndCoveredOnce) {
  const char* models = std::getenv("HILBRUSH_TEST_MODELS");
  if (!models) GTEST_SKIP() << "HILBRUSH_TEST_MODELS is not set";
  const auto file = std::filesystem::path(models) / GetParam();
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not there";
  const auto no_image = [](const std::filesystem::path&, std::size_t) -> Result<Texture> {
    return Failure{"not needed"};
  };
  PlacementOptions placement;
  placement.size_m = .08;
  TexturedMesh mesh = repair_mesh(place_on_table(load_model(file, no_image), placement)).mesh;
  for (auto& corners : mesh.corner_luminance) corners.fill(0);
  const SurfaceCurve curve(mesh);
  for (const ComponentReport& component : curve.components())
    EXPECT_TRUE(component.is_mapped) << component.order_reason;

  ToneOptions options;
  options.untextured = Untextured::kMaterial;
  const ToneField tone(mesh, options);
  double area = 0;
  visit_patches(CurveMass(curve, tone), {mesh.area_m2() / 5000, 4}, [&](const Patch& patch) {
    for (const PatchPiece& piece : patch.pieces) area += piece.integral.area_m2;
  });
  EXPECT_NEAR(area / mesh.area_m2(), 1, 1e-9);

  SampleOptions sample;
  sample.dot_count = 20000;
  SampleReport report;
  EXPECT_EQ(place_dots(curve, tone, sample, &report).dots.size(), 20000u);
  EXPECT_LT(report.path_constant, 1.05);
}

INSTANTIATE_TEST_SUITE_P(Models, RealSurface,
                         testing::Values("facebookresearch+pytorch3d/docs/tutorials/data/cow_mesh/cow.obj",
                                         "odedstein+meshes/objects/nefertiti/nefertiti-lowres.obj",
                                         "odedstein+meshes/objects/plane/plane_holes.obj"));

}  // namespace
}  // namespace hilbrush
