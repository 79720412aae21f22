// A picture that is repeated until it is finer than a pitch keeps its tone.
#include <gtest/gtest.h>

#include <cmath>

#include "config/cell_file.h"
#include "sampling/place_dots.h"
#include "sim/film/fidelity.h"
#include "sim/film/picture_means.h"
#include "tests/support/meshes.h"

namespace hilbrush {
namespace {

constexpr double kSideM = .040, kPitchM = .000254;

/// Upright, under bricks with black joints: four texels of a course's 32.
TexturedMesh brick_square(int repeats) {
  TexturedMesh mesh = test::with_texture(
      test::grid(1, 1, [](double u, double v) { return Eigen::Vector3d(u * kSideM, 0, v * kSideM); }), 128,
      128, [](int i, int j) { return j % 32 < 4 || (i + j / 32 % 2 * 32) % 64 < 4 ? 0 : 1; });
  for (auto& corners : mesh.corner_uv)
    for (Eigen::Vector2d& uv : corners) uv *= repeats;
  return mesh;
}

FidelityFigures paint(int repeats, double curve_pitch_m, Sampler sampler) {
  const TexturedMesh mesh = brick_square(repeats);
  const CellDescription cell = load_cell(find_cell("default"));
  ToneOptions options = cell_tone(cell, {.sampler = sampler_name(sampler)}).options;
  options.pitch_m = curve_pitch_m;
  const ToneField tone(mesh, options);
  SampleOptions sample;
  sample.sampler = sampler;
  sample.pitch_m = kPitchM;
  const DotSequence dots = place_dots(SurfaceCurve(mesh), tone, sample);
  Film film(mesh, cell, kPitchM);
  expose_dots(film, dots);
  return measure_fidelity(film, tone, {}, 1).whole;
}

TEST(FineTexture, KeepsItsToneHoweverFine) {
  for (const Sampler sampler : {Sampler::kCentroid, Sampler::kBlue})
    for (const int repeats : {1, 12}) {
      const FidelityFigures figures = paint(repeats, kPitchM, sampler);
      EXPECT_LE(figures.tone_rms, .01) << repeats << ' ' << sampler_name(sampler);
      EXPECT_GE(figures.f2_db, repeats == 1 ? 39 : 32) << repeats << ' ' << sampler_name(sampler);
    }
}

TEST(FineTexture, ByTexelsItWouldBeTwiceTooDark) {
  EXPECT_LE(paint(12, 0, Sampler::kCentroid).f2_db, 20);
}

}  // namespace
}  // namespace hilbrush
