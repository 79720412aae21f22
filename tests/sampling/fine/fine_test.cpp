#include "sampling/fine/fine.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <cstring>
#include <numbers>

#include "sampling/base/input_error.h"
#include "sampling/place_dots.h"
#include "tests/support/meshes.h"

namespace hilbrush {
namespace {

double saturating(double dose) {
  return 1 - std::exp(-3 * dose);
}

/// A flat picture of one meter by one: light gray rings on darker gray, and a white corner.
struct Sheet {
  Sheet()
      : mesh(test::with_texture(test::rectangle(1, 1, 1, 1), 96, 96,
                                [](int i, int j) {
                                  if (i > 80 && j > 80) return 1.f;
                                  return .45f + .3f * std::sin(.004f * static_cast<float>(i * i + j * j));
                                })),
        tone(mesh, options()),
        curve(mesh) {
    SampleOptions settings;
    settings.pitch_m = 1. / 48;
    dots = place_dots(curve, tone, settings);
    spot = {.705 * dots.pitch_m, saturating};
  }
  /// Roughly undoes the paint's dot gain.
  static ToneOptions options() {
    ToneOptions options;
    options.curve = {{0, .2, .4, .6, .8, 1}, {0, .134, .273, .434, .684, 2}};
    return options;
  }

  /// Mean square of painted minus wanted, both blurred by `sigma` pitches; by brute force on a grid of its
  /// own, a third of a pitch wide, without the border.
  double error(const DotSequence& sequence, double sigma) const {
    constexpr int kSide = 48 * 3;
    std::vector<double> difference(kSide * kSide);
    const double step = 1. / kSide, radius2 = spot.radius_m * spot.radius_m;
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x) {
        const Eigen::Vector2d p((x + .5) * step, (y + .5) * step);
        double dose = 0;
        for (const Dot& dot : sequence.dots) {
          const double r2 = (dot.position_O.head<2>() - p).squaredNorm();
          if (r2 < 4 * radius2)
            dose += dot.level * 2 * dots.pitch_m * dots.pitch_m / (std::numbers::pi * radius2) *
                    std::exp(-2 * r2 / radius2);
        }
        const bool is_lower = p.x() >= p.y();
        const SurfacePoint point = is_lower ? SurfacePoint{0, {1 - p.x(), p.x() - p.y(), p.y()}}
                                            : SurfacePoint{1, {1 - p.y(), p.x(), p.y() - p.x()}};
        difference[static_cast<std::size_t>(y * kSide + x)] = spot.coverage(dose) - tone.wanted(point);
      }
    const int reach = static_cast<int>(9 * sigma), border = 9;
    double square = 0;
    int number = 0;
    for (int y = border; y < kSide - border; y += 2)
      for (int x = border; x < kSide - border; x += 2, ++number) {
        double sum = 0, weights = 0;
        for (int j = std::max(-reach, -y); j <= std::min(reach, kSide - 1 - y); ++j)
          for (int i = std::max(-reach, -x); i <= std::min(reach, kSide - 1 - x); ++i) {
            const double weight = std::exp(-(i * i + j * j) / (2 * 9 * sigma * sigma));
            sum += weight * difference[static_cast<std::size_t>((y + j) * kSide + x + i)];
            weights += weight;
          }
        square += std::pow(sum / weights, 2);
      }
    return square / number;
  }

  TexturedMesh mesh;
  ToneField tone;
  SurfaceCurve curve;
  DotSequence dots;
  SpotModel spot;
};

TEST(Fine, GainsThreeDecibels) {
  const Sheet sheet;
  const DotSequence fine = refine_dots(sheet.curve, sheet.tone, sheet.dots, sheet.spot);
  EXPECT_GE(10 * std::log10(sheet.error(sheet.dots, 1) / sheet.error(fine, 1)), 3);
  EXPECT_GE(10 * std::log10(sheet.error(sheet.dots, 2) / sheet.error(fine, 2)), 1)
      << "the coarser picture gains too";
}

TEST(Fine, KeepsCountOrderAndSurface) {
  Sheet sheet;
  for (std::size_t i = 0; i < sheet.dots.dots.size(); i += 3) sheet.dots.dots[i].level = .6f;
  const DotSequence fine = refine_dots(sheet.curve, sheet.tone, sheet.dots, sheet.spot);
  ASSERT_EQ(fine.dots.size(), sheet.dots.dots.size());
  EXPECT_EQ(fine.pitch_m, sheet.dots.pitch_m);
  std::size_t moved = 0;
  for (std::size_t i = 0; i < fine.dots.size(); ++i) {
    const Dot &before = sheet.dots.dots[i], &after = fine.dots[i];
    EXPECT_EQ(after.level, before.level);
    EXPECT_EQ(after.component, before.component);
    EXPECT_EQ(after.position_O.z(), 0);
    EXPECT_GE(after.position_O.head<2>().minCoeff(), 0);
    EXPECT_LE(after.position_O.head<2>().maxCoeff(), 1);
    EXPECT_GT(after.tone, 0);
    EXPECT_LT((after.position_O - before.position_O).norm(), 5 * fine.pitch_m);
    moved += after.position_O != before.position_O;
  }
  EXPECT_GT(moved, fine.dots.size() / 2);
}

TEST(Fine, SameBytesForAnyNumberOfThreads) {
  const Sheet sheet;
  std::vector<DotSequence> results;
  for (const std::size_t threads : {1u, 4u}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    results.push_back(refine_dots(sheet.curve, sheet.tone, sheet.dots, sheet.spot, {5}));
  }
  for (std::size_t i = 0; i < results[0].dots.size(); ++i)
    ASSERT_EQ(std::memcmp(results[0].dots[i].position_O.data(), results[1].dots[i].position_O.data(),
                          3 * sizeof(double)),
              0)
        << "dot " << i;
}

TEST(Fine, FewPassesDoNoHarm) {
  const Sheet sheet;
  const double before = sheet.error(sheet.dots, 1);
  for (const int passes : {1, 2, 4})
    EXPECT_LE(sheet.error(refine_dots(sheet.curve, sheet.tone, sheet.dots, sheet.spot, {passes}), 1),
              1.02 * before)
        << passes << " passes";
}

TEST(Fine, RefusesWhatMakesNoSense) {
  const Sheet sheet;
  EXPECT_THROW(refine_dots(sheet.curve, sheet.tone, sheet.dots, {0, saturating}), InputError);
  EXPECT_THROW(refine_dots(sheet.curve, sheet.tone, sheet.dots, sheet.spot, {0}), InputError);
  const DotSequence none{sheet.dots.pitch_m, {}};
  EXPECT_TRUE(refine_dots(sheet.curve, sheet.tone, none, sheet.spot).dots.empty());
}

}  // namespace
}  // namespace hilbrush
