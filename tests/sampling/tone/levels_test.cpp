#include "sampling/tone/levels.h"

#include <gtest/gtest.h>

#include <array>
#include <map>

#include "sampling/place_dots.h"
#include "tests/support/meshes.h"

namespace hilbrush {
namespace {

const ToneCurve kCurve{{0, .3, .8, 1}, {0, .2, .9, 2}};

double asked_energy(const ToneField& tone, double pitch_m) {
  const std::array<Eigen::Vector2d, 3> whole{Eigen::Vector2d(0, 0), Eigen::Vector2d(1, 0),
                                             Eigen::Vector2d(0, 1)};
  double mass = 0;
  for (std::uint32_t t = 0; t < tone.mesh().triangle_count(); ++t) mass += tone.integrate(t, whole).mass;
  return mass / (pitch_m * pitch_m);
}

TEST(Levels, TheDensityCurveTimesTheLevelIsTheCurve) {
  for (int count = 1; count <= kMaxLevels; ++count) {
    const std::vector<double> levels = energy_levels(count, 2);
    ASSERT_EQ(levels.size(), static_cast<std::size_t>(count));
    const ToneCurve density = density_curve(kCurve, levels);
    for (int i = 0; i <= 1000; ++i) {
      const double wanted = i / 1000., asked = kCurve(wanted), level = levels[level_for(levels, asked)];
      EXPECT_NEAR(density(wanted), asked / level, 1e-3) << wanted << ' ' << count;
      EXPECT_EQ(dots_for(levels, asked), asked / level);
      if (count > 1 && level < levels.back()) {
        EXPECT_LE(density(wanted), kEnoughDots + 1e-9);
      }
    }
  }
}

TEST(Levels, FlatToneHasOneLevelThroughout) {
  TexturedMesh mesh = test::rectangle(.02, .013, 3, 2);
  for (auto& corners : mesh.corner_luminance) corners = {.5f, .5f, .5f};
  const std::vector<double> levels = energy_levels(3, 2);
  ToneOptions options{.untextured = Untextured::kMaterial, .curve = kCurve};
  const ToneField asked(mesh, options);
  options.curve = density_curve(kCurve, levels);
  const ToneField density(mesh, options);
  DotSequence dots = place_dots(SurfaceCurve(mesh), density, {.pitch_m = .25e-3});
  assign_levels(dots, asked, density, levels);
  for (const Dot& dot : dots.dots)
    EXPECT_FLOAT_EQ(dot.level, static_cast<float>(levels[level_for(levels, kCurve(.5))]));
}

TEST(Levels, EnergiesAddUpToWhatIsAsked) {
  TexturedMesh mesh =
      test::rectangle(.02, .02, 8, 8);  // a ramp of grays over all levels, in steps and smooth
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t)
    for (int c = 0; c < 3; ++c)
      mesh.corner_luminance[t][static_cast<std::size_t>(c)] =
          static_cast<float>(t % 3 == 0 ? .3 : std::clamp(mesh.corner(t, c).x() / .02, 0., 1.));
  for (int count = 2; count <= kMaxLevels; ++count) {
    const std::vector<double> levels = energy_levels(count, 2);
    ToneOptions options{.untextured = Untextured::kMaterial, .curve = kCurve};
    const ToneField asked(mesh, options);
    options.curve = density_curve(kCurve, levels);
    const ToneField density(mesh, options);
    DotSequence dots = place_dots(SurfaceCurve(mesh), density, {.pitch_m = .25e-3});
    assign_levels(dots, asked, density, levels);
    double energy = 0;
    std::map<float, int> counts;
    for (const Dot& dot : dots.dots) energy += dot.level, ++counts[dot.level];
    EXPECT_NEAR(energy, asked_energy(asked, .25e-3), levels.back()) << count;
    EXPECT_EQ(counts.size(), levels.size());
    EXPECT_LT(static_cast<double>(dots.dots.size()), .8 * asked_energy(asked, .25e-3)) << count;
  }
}

}  // namespace
}  // namespace hilbrush
