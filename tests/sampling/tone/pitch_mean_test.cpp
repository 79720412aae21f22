#include "sampling/tone/pitch_mean.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <random>

#include "sampling/tone/tone_field.h"
#include "tests/support/meshes.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d;
constexpr unsigned kPitchSeed = 20261201;
constexpr double kSideM = .02;

const ToneCurve kBent{{0, .2, .6, .9, 1}, {0, .12, .42, .9, 2}};

ToneOptions options_for(double pitch_m, const ToneCurve& curve = kBent) {
  ToneOptions options;
  options.curve = curve;
  options.pitch_m = pitch_m;
  return options;
}

/// A square of kSideM under a texture that repeats `u` and `v` times along its sides.
TexturedMesh square(int size, double u, double v, const std::function<double(int, int)>& coverage) {
  TexturedMesh mesh = test::with_texture(test::rectangle(kSideM, kSideM, 2, 2), size, size,
                                         [&](int i, int j) { return 1 - coverage(i, j); });
  for (auto& corners : mesh.corner_uv)
    for (Vector2d& corner : corners) corner = corner.cwiseProduct(Vector2d(u, v));
  return mesh;
}

/// Asked coverage on the mean.
double mean_asked(const TexturedMesh& mesh, const ToneOptions& options) {
  return asked_mass_m2(ToneField(mesh, options)) / mesh.area_m2();
}

std::vector<double> asked_at_random(const ToneField& tone, int count) {
  std::mt19937 random(kPitchSeed);
  std::uniform_real_distribution<double> uniform(0, .5);
  std::vector<double> asked;
  for (int k = 0; k < count; ++k) {
    const Vector2d b(uniform(random), uniform(random));
    const auto triangle =
        static_cast<std::uint32_t>(static_cast<std::size_t>(k) % tone.mesh().triangle_count());
    asked.push_back(tone.asked({triangle, {1 - b.sum(), b.x(), b.y()}}));
  }
  return asked;
}

TEST(PitchMean, FlatToneAsksForWhatTheCurveSays) {
  for (const double coverage : {0., .1, .5, .95, 1.})
    for (const double repeats : {.05, 1., 7., 300.}) {
      const TexturedMesh mesh = square(16, repeats, repeats, [&](int, int) { return coverage; });
      for (const double asked : asked_at_random(ToneField(mesh, options_for(.0005)), 50))
        EXPECT_NEAR(asked, kBent(coverage), 2e-6) << coverage << ' ' << repeats;
    }
}

TEST(PitchMean, WhatIsFinerThanAPitchAsksForTheCurveOfItsMean) {
  // Black lines, a quarter of the surface.
  const auto lines = [](int, int j) { return j % 4 == 0 ? 1 : 0; };
  EXPECT_GT(mean_asked(square(16, 8, 40, lines), options_for(0)), 1.4 * kBent(.25)) << "by texels";
  for (const double u : {1., 8., 60.})
    for (const double v : {40., 57., 90., 400.})  // a line every .25 pitches at most
      EXPECT_NEAR(mean_asked(square(16, u, v, lines), options_for(.0005)), kBent(.25), .01 * kBent(.25))
          << u << " by " << v;
}

TEST(PitchMean, WhatIsCoarserThanAPitchIsAskedForAsEver) {
  std::mt19937 random(kPitchSeed);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<double> tones(64);
  for (double& tone : tones) tone = uniform(random);
  // A texel is 12 pitches.
  const TexturedMesh mesh =
      square(8, 1, 1, [&](int i, int j) { return tones[static_cast<std::size_t>(8 * j + i)]; });
  const ToneOptions by_texel = options_for(0), by_pitch = options_for(kSideM / 8 / 12);
  const auto before = asked_at_random(ToneField(mesh, by_texel), 400),
             now = asked_at_random(ToneField(mesh, by_pitch), 400);
  for (std::size_t i = 0; i < now.size(); ++i) EXPECT_NEAR(now[i], before[i], .06) << "seed " << kPitchSeed;
  EXPECT_NEAR(mean_asked(mesh, by_pitch), mean_asked(mesh, by_texel), .004);
}

TEST(PitchMean, AStraightCurveAsksForTheTextureItself) {
  std::mt19937 random(kPitchSeed);
  std::uniform_real_distribution<double> uniform(0, 1);
  const TexturedMesh mesh = square(16, 20, 20, [&](int, int) { return uniform(random); });
  const ToneCurve straight{{0, .5, 1}, {0, 1, 2}};
  EXPECT_EQ(asked_at_random(ToneField(mesh, options_for(.001, straight)), 200),
            asked_at_random(ToneField(mesh, options_for(0, straight)), 200));
}

TEST(PitchMean, TrianglesOfAllScalesAskForTheSame) {
  // Each triangle shows the checks at another size; all are far finer than a pitch.
  TexturedMesh mesh = square(32, 1, 1, [](int i, int j) { return (i + j) % 2; });
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t)
    for (Vector2d& uv : mesh.corner_uv[t]) uv *= 20 * std::pow(1.37, static_cast<double>(t));
  const ToneField tone(mesh, options_for(.002));
  const std::array<Vector2d, 3> whole{Vector2d(0, 0), Vector2d(1, 0), Vector2d(0, 1)};
  for (std::uint32_t t = 0; t < mesh.triangle_count(); ++t) {
    const ToneIntegral integral = tone.integrate(t, whole);
    EXPECT_NEAR(integral.mass / integral.area_m2, kBent(.5), .01 * kBent(.5)) << t;
  }
}

TEST(PitchMean, NeverAsksForMoreThanFourTimesTheMean) {
  // A black texel in the white, in grids of all sizes: the detail's Gaussian is four times as high as the
  // mean's.
  for (const double repeats : {.2, 1., 5., 40.}) {
    const TexturedMesh mesh = square(33, repeats, repeats, [](int i, int j) { return i == 16 && j == 16; });
    for (const double asked : asked_at_random(ToneField(mesh, options_for(.001)), 400)) {
      EXPECT_GE(asked, 0);
      EXPECT_LE(asked, 2 * 1.02);
    }
  }
}

TEST(PitchMean, SameTonesForAnyNumberOfThreads) {
  std::mt19937 random(kPitchSeed);
  std::uniform_real_distribution<double> uniform(0, 1);
  const TexturedMesh mesh = square(150, 3, 9, [&](int, int) { return uniform(random); });
  const auto many = asked_at_random(ToneField(mesh, options_for(.0007)), 500);
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(asked_at_random(ToneField(mesh, options_for(.0007)), 500), many);
}

TEST(PitchMean, DegenerateTrianglesDoNoHarm) {
  TexturedMesh mesh = square(16, 5, 5, [](int i, int) { return i % 2; });
  mesh.triangles.push_back({0, 0, 1});  // no area
  mesh.corner_uv.push_back({Vector2d(0, 0), Vector2d(3, 0), Vector2d(0, 3)});
  mesh.triangles.push_back(mesh.triangles[0]);
  mesh.corner_uv.push_back({Vector2d(.3, .3), Vector2d(.3, .3), Vector2d(.3, .3)});  // a point of the texture
  mesh.triangles.push_back(mesh.triangles[0]);
  mesh.corner_uv.push_back({Vector2d(0, 0), Vector2d(1e9, 0), Vector2d(0, 1e9)});  // beyond all texels
  mesh = test::finish(std::move(mesh));
  const ToneField tone(mesh, options_for(.001));
  const std::array<Vector2d, 3> whole{Vector2d(0, 0), Vector2d(1, 0), Vector2d(0, 1)};
  const auto first = static_cast<std::uint32_t>(mesh.triangle_count() - 3);
  EXPECT_EQ(tone.integrate(first, whole).mass, 0);
  for (const std::uint32_t t : {first + 1, first + 2}) {
    const ToneIntegral integral = tone.integrate(t, whole);
    EXPECT_GE(integral.mass, 0);
    EXPECT_LE(integral.mass, 2.1 * integral.area_m2);
  }
  EXPECT_NEAR(tone.integrate(first + 2, whole).mass / tone.integrate(first + 2, whole).area_m2, kBent(.5),
              .01);
}

}  // namespace
}  // namespace hilbrush
