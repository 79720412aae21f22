#include "sampling/predictive/predictive_loop.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cstring>

#include "sampling/place_dots.h"
#include "sim/film/fidelity.h"
#include "sim/film/picture_means.h"
#include "tests/sim/test_objects.h"

namespace hilbrush {
namespace {

constexpr double kLoopPitch = .254e-3;

/// Bars of black on white, some thinner than a pitch, and a transparent part: a tone curve made on flat gray
/// gets their coverage wrong.
TexturedMesh bars() {
  TexturedMesh mesh = test::square(60 * kLoopPitch);
  mesh.corner_uv = {{Eigen::Vector2d(0, 0), {1, 0}, {1, 1}}, {Eigen::Vector2d(0, 0), {1, 1}, {0, 1}}};
  Texture texture{.width = 256, .height = 256, .luminance = {}, .opacity = {}, .name = "bars"};
  for (int y = 0; y < 256; ++y)
    for (int x = 0; x < 256; ++x) {
      texture.luminance.push_back((x / (y < 128 ? 3 : 9)) % 2 == 0 ? 1.f : 0.f);
      texture.opacity.push_back(y > 200 ? 0.f : 1.f);
    }
  mesh.textures.push_back(std::move(texture));
  mesh.materials = {{.name = "bars", .source = ColorSource::kTexture, .texture = 0}};
  return mesh;
}

class PredictiveLoop : public testing::Test {
 protected:
  PredictiveLoop() : cell_(test::handmade_cell()), mesh_(bars()), curve_(mesh_) {
    options_.curve = {{0, .1, .2, .3, .4, .5, .6, .7, .8, .9, 1},  // of such a cell, from its wedge
                      {0, .068, .134, .202, .273, .35, .434, .542, .684, .914, 1.5}};
    tone_.emplace(mesh_, options_);
  }

  DotSequence place(int rounds, std::optional<std::uint64_t> count = {}) {
    report_ = {};
    SampleOptions sample;
    if (count)
      sample.dot_count = count;
    else
      sample.pitch_m = kLoopPitch;
    return place_predictively(
        *tone_, *tone_, options_.curve, {.rounds = rounds, .levels = {1}},
        [&](const ToneField& density) { return place_dots(curve_, density, sample); },
        film_predictor(cell_, *tone_), &report_);
  }

  FidelityFigures fidelity(const DotSequence& dots) const {
    Film film(mesh_, cell_, dots.pitch_m);
    expose_dots(film, dots);
    return measure_fidelity(film, *tone_, {}, 1).whole;
  }

  CellDescription cell_;
  TexturedMesh mesh_;
  SurfaceCurve curve_;
  ToneOptions options_;
  std::optional<ToneField> tone_;
  PredictiveReport report_;
};

TEST_F(PredictiveLoop, MakesTheToneRight) {
  const FidelityFigures before = fidelity(place(0)), after = fidelity(place(2));
  EXPECT_GT(after.f2_db, before.f2_db + 3);
  EXPECT_GT(after.f1_db, before.f1_db);
  ASSERT_EQ(report_.error_rms.size(), 2u);
  EXPECT_LT(report_.error_rms[1], report_.error_rms[0]);
}

TEST_F(PredictiveLoop, IsTheSameForAnyNumberOfThreads) {
  const DotSequence many = place(1);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const DotSequence single = place(1);
  ASSERT_EQ(many.dots.size(), single.dots.size());
  for (std::size_t i = 0; i < many.dots.size(); ++i)
    ASSERT_EQ(0, std::memcmp(many.dots[i].position_O.data(), single.dots[i].position_O.data(),
                             sizeof(Eigen::Vector3d)))
        << i;
}

TEST_F(PredictiveLoop, LeavesTransparentSurfaceWithoutDots) {
  for (const Dot& dot : place(2).dots)
    EXPECT_GT(tone_->asked(foot_of_perpendicular(mesh_, dot.triangle, dot.position_O)), 0)
        << dot.position_O.transpose();
}

TEST_F(PredictiveLoop, KeepsAGivenNumberOfDots) {
  EXPECT_EQ(place(2, 1234).dots.size(), 1234u);
}

}  // namespace
}  // namespace hilbrush
