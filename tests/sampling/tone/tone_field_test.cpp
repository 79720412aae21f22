#include "sampling/tone/tone_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/meshes.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d;
constexpr unsigned kToneSeed = 20260117;

SurfacePoint at(std::uint32_t t, const Vector2d& b) {
  return {t, {1 - b.x() - b.y(), b.x(), b.y()}};
}

/// The integrals by 2 n^2 midpoints.
ToneIntegral brute_force(const ToneField& tone, std::uint32_t t, const std::array<Vector2d, 3>& p, int n) {
  const Vector2d e1 = p[1] - p[0], e2 = p[2] - p[0];
  const double area = std::abs(e1.x() * e2.y() - e1.y() * e2.x()) * tone.mesh().area_vector(t).norm() /
                      (static_cast<double>(n) * n);
  ToneIntegral sum;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n - i; ++j)
      for (const double shift : {1. / 3, 2. / 3}) {
        if (shift > .5 && j == n - i - 1) continue;
        const Vector2d b = p[0] + (i + shift) / n * e1 + (j + shift) / n * e2;
        const double f = tone.asked(at(t, b));
        sum.area_m2 += area;
        sum.mass += f * area;
        sum.first += f * area * b;
        sum.square += f * f * area;
      }
  return sum;
}

ToneCurve bent_curve() {
  return {{0, .2, .6, 1}, {0, .1, .5, 1.3}};
}

void expect_exact(const ToneField& tone, std::mt19937& random, double tolerance) {
  std::uniform_real_distribution<double> uniform(0, 1);
  for (std::uint32_t t = 0; t < tone.mesh().triangle_count(); ++t) {
    std::array<Vector2d, 3> p;
    for (Vector2d& b : p) {
      b = Vector2d(uniform(random), uniform(random));
      if (b.sum() > 1) b = Vector2d(1 - b.x(), 1 - b.y());
    }
    const ToneIntegral exact = tone.integrate(t, p), brute = brute_force(tone, t, p, 600);
    EXPECT_NEAR(exact.area_m2 / brute.area_m2, 1, 1e-9);
    EXPECT_NEAR(exact.mass / brute.area_m2, brute.mass / brute.area_m2, tolerance)
        << "seed " << kToneSeed << " triangle " << t;
    EXPECT_NEAR((exact.first - brute.first).norm() / brute.area_m2, 0, tolerance)
        << "seed " << kToneSeed << " triangle " << t;
    EXPECT_NEAR(exact.square / brute.area_m2, brute.square / brute.area_m2, 2 * tolerance)
        << "seed " << kToneSeed << " triangle " << t;
  }
}

TEST(ToneField, IntegralsOfTexturesAreExactHoweverTheyAreAddressed) {
  std::mt19937 random(kToneSeed);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (const bool repeat_u : {true, false})
    for (const bool repeat_v : {true, false})
      for (const double extent : {.3, 3., 9.}) {
        TexturedMesh mesh = test::with_texture(
            test::rectangle(.05, .03, 2, 1), 23, 7, [&](int, int) { return uniform(random); }, repeat_u,
            repeat_v);
        // Anywhere, also negative, mirrored and beyond the picture.
        for (auto& corners : mesh.corner_uv)
          for (Vector2d& uv : corners) uv = extent * Vector2d(uniform(random) - .5, uniform(random) - .5);
        ToneOptions options;
        options.curve = bent_curve();
        expect_exact(ToneField(mesh, options), random, 2e-5 * std::max(1., extent));
        options.pitch_m = .002;
        expect_exact(ToneField(mesh, options), random, 2e-5 * std::max(1., extent));
      }
}

TEST(ToneField, CollapsedTextureCoordinatesStillHaveATone) {
  TexturedMesh mesh =
      test::with_texture(test::rectangle(.05, .05, 1, 1), 8, 8, [](int i, int) { return i / 7.; });
  mesh.corner_uv[0].fill(Vector2d(.40625, .5));  // a point
  mesh.corner_uv[1] = {Vector2d(.1, .1), Vector2d(.5, .5), Vector2d(.9, .9)};
  const ToneField tone(mesh, {});
  const std::array<Vector2d, 3> whole{Vector2d(0, 0), Vector2d(1, 0), Vector2d(0, 1)};
  for (std::uint32_t t = 0; t < 2; ++t) {
    const ToneIntegral exact = tone.integrate(t, whole), brute = brute_force(tone, t, whole, 1500);
    EXPECT_NEAR(exact.mass / exact.area_m2, brute.mass / brute.area_m2, 1e-5);
  }
}

TEST(ToneField, LinearColorsAreExactAcrossTheCurvesKnots) {
  std::mt19937 random(kToneSeed);
  std::uniform_real_distribution<float> uniform(0, 1);
  TexturedMesh mesh = test::rectangle(.05, .03, 4, 2);
  for (auto& corners : mesh.corner_luminance)
    for (float& luminance : corners) luminance = uniform(random);
  mesh.materials[0].opacity = .8;
  ToneOptions options;
  options.reflectance_white = .85;
  options.reflectance_black = .1;
  options.curve = bent_curve();
  expect_exact(ToneField(mesh, options), random, 2e-6);
}

TEST(ToneField, MurrayDaviesAndTheToneCurve) {
  TexturedMesh mesh = test::finish(test::rectangle(.01, .01, 1, 1), .4f);
  for (auto& corners : mesh.corner_luminance) corners.fill(.4f);
  ToneOptions options;
  options.reflectance_white = .8;
  options.reflectance_black = .05;
  options.curve = bent_curve();
  const ToneField tone(mesh, options);
  const double wanted = (.8 - .4) / .75;
  EXPECT_NEAR(tone.wanted(at(0, {.2, .3})), wanted, 1e-7);
  EXPECT_NEAR(tone.asked(at(0, {.2, .3})), bent_curve()(wanted), 1e-7);
}

TEST(ToneField, TheCurveBendsBetweenTexelsToo) {
  // Black beside white: halfway the curve asks for much less than the mean of what it asks for black and
  // white.
  const TexturedMesh mesh = test::with_texture(
      test::rectangle(.01, .01, 1, 1), 4, 4, [](int i, int) { return i % 2; }, false, false);
  ToneOptions options;
  options.curve = {{0, .5, 1}, {0, .35, 2}};
  const ToneField tone(mesh, options);
  std::mt19937 random(kToneSeed);
  std::uniform_real_distribution<double> uniform(0, .5);
  for (int k = 0; k < 1000; ++k) {
    const SurfacePoint point = at(static_cast<std::uint32_t>(k % 2), {uniform(random), uniform(random)});
    EXPECT_NEAR(tone.asked(point), options.curve(tone.wanted(point)), .06) << "seed " << kToneSeed;
  }
}

TEST(ToneField, OneChannelMultipliesThreeReplace) {
  for (const int channels : {1, 2, 3, 4}) {
    TexturedMesh mesh =
        test::with_texture(test::rectangle(.01, .01, 1, 1), 4, 4, [](int, int) { return .5; });
    for (auto& corners : mesh.corner_luminance) corners.fill(.5f);
    mesh.textures[0].channels = channels;
    const ToneField tone(mesh, {});
    EXPECT_NEAR(tone.wanted(at(0, {.2, .3})), channels <= 2 ? .75 : .5, 1e-6) << channels;
    EXPECT_NEAR(tone.asked(at(0, {.2, .3})), channels <= 2 ? .75 : .5, 1e-6) << channels;
  }
}

TEST(ToneField, OpacityScalesCoverage) {
  TexturedMesh mesh = test::with_texture(test::rectangle(.01, .01, 1, 1), 4, 4, [](int, int) { return 0; });
  mesh.textures[0].opacity.assign(16, .25f);
  mesh.materials[0].opacity = .5;
  EXPECT_NEAR(ToneField(mesh, {}).wanted(at(0, {.2, .3})), .125, 1e-6);
  EXPECT_NEAR(ToneField(mesh, {}).asked(at(0, {.2, .3})), .125, 1e-6);
  mesh.materials[0].opacity = 0;
  EXPECT_TRUE(ToneField(mesh, {}).is_blank(0));
}

TEST(ToneField, UntexturedParts) {
  TexturedMesh mesh = test::both(test::rectangle(.01, .01, 1, 1), test::rectangle(.01, .01, 1, 1));
  mesh.materials.resize(2);
  mesh.materials[1].source = ColorSource::kMaterial;
  mesh.material_index = {0, 0, 1, 1};
  for (auto& corners : mesh.corner_luminance) corners.fill(.3f);
  const auto is_blank = [&](Untextured rule) {
    ToneOptions options;
    options.untextured = rule;
    return ToneField(mesh, options).is_blank(2);
  };
  EXPECT_TRUE(is_blank(Untextured::kAuto)) << "another part has colors";
  EXPECT_TRUE(is_blank(Untextured::kBlank));
  EXPECT_FALSE(is_blank(Untextured::kMaterial));
  mesh.materials[0].source = ColorSource::kMaterial;
  EXPECT_FALSE(is_blank(Untextured::kAuto));
}

}  // namespace
}  // namespace hilbrush
