#include "sampling/curve/stream_dots.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "sampling/base/input_error.h"
#include "sampling/curve/patches.h"
#include "sampling/curve/surface_curve.h"
#include "sampling/model/mesh_repair.h"
#include "sampling/place_dots.h"
#include "tests/support/meshes.h"

namespace hilbrush {
namespace {

using Eigen::Vector3d;

SampleOptions sample_options(std::uint64_t count, Sampler sampler = Sampler::kCentroid) {
  SampleOptions options;
  options.dot_count = count;
  options.sampler = sampler;
  return options;
}

DotSequence sample(const TexturedMesh& mesh, const SampleOptions& options, SampleReport* report = nullptr) {
  const SurfaceCurve curve(mesh);
  const ToneField tone(mesh, {});
  return place_dots(curve, tone, options, report);
}

double largest_jump(const DotSequence& sequence) {
  double largest = 0;
  for (std::size_t i = 1; i < sequence.dots.size(); ++i)
    largest = std::max(largest, (sequence.dots[i].position_O - sequence.dots[i - 1].position_O).norm());
  return largest / sequence.pitch_m;
}

/// Distance from each dot to the nearest other one, in pitches, sorted. The order along the curve makes a
/// simple search by x enough.
std::vector<double> nearest_distances(const DotSequence& sequence) {
  std::vector<Vector3d> p;
  for (const Dot& dot : sequence.dots) p.push_back(dot.position_O);
  std::sort(p.begin(), p.end(), [](const Vector3d& a, const Vector3d& b) { return a.x() < b.x(); });
  std::vector<double> distances;
  for (std::size_t i = 0; i < p.size(); ++i) {
    double best = 1e300;
    for (std::size_t j = i + 1; j < p.size() && p[j].x() - p[i].x() < best; ++j)
      best = std::min(best, (p[j] - p[i]).norm());
    for (std::size_t j = i; j-- > 0 && p[i].x() - p[j].x() < best;)
      best = std::min(best, (p[j] - p[i]).norm());
    distances.push_back(best / sequence.pitch_m);
  }
  std::sort(distances.begin(), distances.end());
  return distances;
}

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

TEST(Sample, PatchesCoverTheSurfaceOnceWhateverTheMesh) {
  for (const auto& [name, awkward] : test::awkward_meshes()) {
    SCOPED_TRACE(name);
    const TexturedMesh mesh = repair_mesh(awkward).mesh;
    const SurfaceCurve curve(mesh);
    const ToneField tone(mesh, {});
    double area = 0, mass = 0;
    visit_patches(CurveMass(curve, tone), {mesh.area_m2() / 500, 4}, [&](const Patch& patch) {
      mass += patch.mass;
      for (const PatchPiece& piece : patch.pieces) area += piece.integral.area_m2;
    });
    EXPECT_NEAR(area / mesh.area_m2(), 1, 1e-9);
    EXPECT_NEAR(mass / mesh.area_m2(), 1, 1e-9);
  }
}

TEST(Sample, ExactCountsOnEveryAwkwardMeshWithEverySampler) {
  for (const auto& [name, awkward] : test::awkward_meshes()) {
    const TexturedMesh mesh = repair_mesh(awkward).mesh;
    const SurfaceCurve curve(mesh);
    const ToneField tone(mesh, {});
    for (const Sampler sampler : {Sampler::kCentroid, Sampler::kJittered, Sampler::kEven, Sampler::kRandom})
      for (const std::uint64_t count : {1, 2, 37, 1000}) {
        const DotSequence sequence = place_dots(curve, tone, sample_options(count, sampler));
        ASSERT_EQ(sequence.dots.size(), count) << name;
        for (const Dot& dot : sequence.dots) {
          ASSERT_NEAR(dot.normal_O.norm(), 1, 1e-5) << name;
          ASSERT_NEAR(dot.smooth_normal_O.norm(), 1, 1e-5) << name;
          ASSERT_LT(dot.triangle, mesh.triangle_count());
          const Vector3d offset = dot.position_O - mesh.corner(dot.triangle, 0);
          ASSERT_NEAR(offset.dot(mesh.area_vector(dot.triangle).normalized()), 0, 1e-9)
              << name << ": off the surface";
          ASSERT_LT(dot.component, curve.components().size());
        }
      }
  }
}

/// A ramp from white to black: bilinear between texels it is linear, so that the mass of any polygon has a
/// closed form.
TexturedMesh ramp() {
  TexturedMesh mesh = test::with_texture(test::rectangle(.04, .04, 3, 3), 64, 4,
                                         [](int i, int) { return 1 - (i + .5) / 64; });
  for (auto& corners : mesh.corner_uv)
    for (Eigen::Vector2d& uv : corners) uv = Eigen::Vector2d(.05 + .9 * uv.x(), uv.y());
  return mesh;
}

/// Each stratum's mass, measured again on the polygons that it is cut from; the worst error, in dots.
double worst_stratum_error(const CurveMass& mass, std::uint64_t count,
                           const std::function<double(const PatchPiece&)>& exact) {
  const double dot_mass = mass.total_m2() / static_cast<double>(count);
  std::vector<double> masses(count);
  visit_stretches(mass, sample_options(count),
                  [&](std::uint64_t stratum, const Patch& patch, double from, double to) {
                    for (const PatchPiece& piece : patch.pieces)
                      masses.at(stratum) += (to - from) * exact(piece);
                  });
  double worst = 0;
  for (const double stratum : masses) worst = std::max(worst, std::abs(stratum / dot_mass - 1));
  return worst;
}

TEST(Sample, EveryStratumOfARampHasItsMass) {
  const TexturedMesh mesh = ramp();
  const SurfaceCurve curve(mesh);
  const ToneField tone(mesh, {});
  const CurveMass mass(curve, tone);
  EXPECT_NEAR(mass.total_m2() / (.5 * mesh.area_m2()), 1, 1e-6);
  const auto by_hand = [&](const PatchPiece& piece) {
    const auto place = [&](std::size_t k) {
      const Eigen::Vector2d& b = piece.corners_b[k];
      return position(mesh, {piece.triangle, {1 - b.sum(), b.x(), b.y()}});
    };
    double sum = 0;
    for (std::size_t i = 2; i < piece.corners_b.size(); ++i) {
      const Vector3d a = place(0), b = place(i - 1), c = place(i);
      const double x = (a.x() + b.x() + c.x()) / 3 / .04;
      sum += .5 * (b - a).cross(c - a).norm() * (.05 + .9 * x);
    }
    return sum;
  };
  EXPECT_LT(worst_stratum_error(mass, 3000, by_hand), 1e-5);
}

TEST(Sample, EveryStratumHasItsMassWhateverTheMesh) {
  const auto texel = [](int i, int j) {
    return (i / 3 + j / 5) % 2 ? .95 : .45 + .45 * std::sin(.3 * i) * std::cos(.2 * j);
  };
  for (const CurveKind kind : {CurveKind::kHilbert, CurveKind::kPeano2})
    for (const auto& [name, awkward] : test::awkward_meshes())
      for (const bool is_textured : {false, true}) {
        const TexturedMesh mesh =
            repair_mesh(is_textured ? test::with_texture(awkward, 64, 64, texel) : awkward).mesh;
        const SurfaceCurve curve(mesh, kind);
        const ToneField tone(mesh, {});
        const CurveMass mass(curve, tone);
        const auto again = [&](const PatchPiece& piece) {
          return tone.integrate(piece.triangle, piece.corners_b).mass;
        };
        for (const std::uint64_t count : {3, 2000})
          EXPECT_LT(worst_stratum_error(mass, count, again), 1e-5)
              << name << (is_textured ? ", textured, " : ", plain, ") << count;
      }
}

/// Large flat areas and fine lines.
TexturedMesh line_drawing() {
  const auto is_line = [](int i, int j) {
    return (i > 170 && i < 174) || j == 512 || j == 513 || std::abs(i - j) < 2;
  };
  return test::with_texture(
      test::rectangle(.05, .05, 4, 4), 1024, 1024, [&](int i, int j) { return is_line(i, j) ? .05 : .6; },
      false, false);
}

TEST(Sample, AdaptivePatchesAreFewAndPlaceTheSameDots) {
  const TexturedMesh mesh = line_drawing();
  const SurfaceCurve curve(mesh);
  const ToneField tone(mesh, {});
  const CurveMass mass(curve, tone);
  SampleOptions options = sample_options(200'000);
  SampleReport adaptive_report, uniform_report;
  const DotSequence adaptive = place_dots(mass, options, &adaptive_report);
  options.uniform_depth = static_cast<int>(adaptive_report.patches_at_depth.size()) - 1;
  const DotSequence uniform = place_dots(mass, options, &uniform_report);
  EXPECT_GE(uniform_report.patch_count, 20 * adaptive_report.patch_count)
      << adaptive_report.patch_count << " adaptive, finest depth " << *options.uniform_depth;
  std::vector<double> apart;
  for (std::size_t i = 0; i < adaptive.dots.size(); ++i)
    apart.push_back((adaptive.dots[i].position_O - uniform.dots[i].position_O).norm() / adaptive.pitch_m);
  EXPECT_LT(mean(apart), .05) << "pitches between a dot and the same dot";
}

TEST(Sample, StreamedDotsArePlacedDots) {
  const TexturedMesh mesh = test::with_texture(
      test::torus(), 64, 64, [](int i, int j) { return .5 + .5 * std::sin(.3 * i) * std::cos(.2 * j); });
  const SurfaceCurve curve(mesh, CurveKind::kPeano2);
  const ToneField tone(mesh, {});
  const CurveMass mass(curve, tone);
  for (const std::uint64_t count : {1, 300, 30000}) {
    const DotSequence all = place_dots(mass, sample_options(count));
    SampleReport report;
    std::size_t i = 0;
    stream_dots(
        mass, sample_options(count),
        [&](std::span<const Dot> dots) {
          for (const Dot& dot : dots) ASSERT_EQ(dot.position_O, all.dots.at(i++).position_O);
        },
        &report);
    EXPECT_EQ(i, count);
    EXPECT_EQ(report.components.at(0).dot_count, count);
    EXPECT_NEAR(report.components.at(0).path_length_m, report.path_length_m, 1e-12);
  }
  const auto stops = [](std::span<const Dot>) { throw InputError("", "enough"); };
  EXPECT_THROW(stream_dots(mass, sample_options(300000), stops), InputError);
}

TEST(Sample, DotsFollowTheTone) {
  const TexturedMesh mesh = ramp();
  const DotSequence sequence = sample(mesh, sample_options(20000));
  std::array<double, 10> counts{};
  for (const Dot& dot : sequence.dots)
    counts[static_cast<std::size_t>(std::min(9., dot.position_O.x() / .004))] += 1;
  for (std::size_t k = 0; k < 10; ++k) {
    const double tone = .05 + .9 * (static_cast<double>(k) + .5) / 10;
    EXPECT_NEAR(counts[k] / 20000, tone / 5, .002) << k;
  }
}

TEST(Sample, PitchAndCountSayTheSame) {
  const TexturedMesh mesh = test::sphere(.02);
  SampleOptions options;
  options.pitch_m = .000254;
  const DotSequence by_pitch = sample(mesh, options);
  EXPECT_EQ(by_pitch.dots.size(),
            static_cast<std::size_t>(std::lround(mesh.area_m2() / (.000254 * .000254))));
  EXPECT_NEAR(sample(mesh, sample_options(by_pitch.dots.size())).pitch_m, .000254, 1e-8);
}

TEST(Sample, NoLongJumpsOnMappedSurfaces) {
  for (const char* name : {"sphere", "cube", "long strip", "needle cylinder"}) {
    SampleReport report;
    const DotSequence sequence =
        sample(repair_mesh(test::awkward_meshes().at(name)).mesh, sample_options(8000), &report);
    EXPECT_LT(largest_jump(sequence), 5) << name;
    EXPECT_LT(report.path_constant, 1.1) << name;
  }
}

TEST(Sample, SameBytesForAnyNumberOfThreads) {
  const TexturedMesh mesh = test::with_texture(
      test::torus(), 64, 64, [](int i, int j) { return .5 + .5 * std::sin(.3 * i) * std::cos(.2 * j); });
  for (const Sampler sampler : {Sampler::kCentroid, Sampler::kJittered, Sampler::kRandom}) {
    std::vector<DotSequence> results;
    for (const std::size_t threads : {1, 2, 5}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      results.push_back(sample(mesh, sample_options(5000, sampler)));
    }
    for (const DotSequence& other : results)
      for (std::size_t i = 0; i < 5000; ++i) {
        ASSERT_EQ(other.dots[i].position_O, results[0].dots[i].position_O) << i;
        ASSERT_EQ(other.dots[i].triangle, results[0].dots[i].triangle) << i;
      }
  }
}

TEST(Sample, SeedsDiffer) {
  const TexturedMesh mesh = test::sphere(.02);
  SampleOptions options = sample_options(500, Sampler::kJittered);
  const DotSequence one = sample(mesh, options);
  options.seed = 2;
  const DotSequence two = sample(mesh, options);
  std::size_t equal = 0;
  for (std::size_t i = 0; i < 500; ++i) equal += one.dots[i].position_O == two.dots[i].position_O;
  EXPECT_LT(equal, 5u);
}

TEST(Sample, BlankSurfaceGetsNoDots) {
  // Black bars, one texel in eight: hardly a stratum's center lies on one by itself.
  const TexturedMesh mesh = test::with_texture(
      test::rectangle(.04, .04, 3, 3), 64, 64, [](int i, int) { return i % 8 == 3 ? 0. : 1.; }, false, false);
  for (const Sampler sampler : {Sampler::kCentroid, Sampler::kJittered, Sampler::kEven, Sampler::kRandom})
    for (const std::uint64_t count : {50, 700, 20000}) {
      const DotSequence sequence = sample(mesh, sample_options(count, sampler));
      std::size_t blank = 0;
      for (const Dot& dot : sequence.dots) blank += dot.tone <= 0;
      EXPECT_EQ(blank, 0u) << count << " dots, sampler " << static_cast<int>(sampler);
    }
}

TEST(Sample, NeedlesPaintAsWellAsEvenTriangles) {
  const auto needles = nearest_distances(sample(test::needle_cylinder(), sample_options(10000)));
  const auto even = nearest_distances(sample(test::even_cylinder(), sample_options(10000)));
  EXPECT_NEAR(mean(needles), mean(even), .02);
  // The even one happens to lie on a grid.
  EXPECT_NEAR(needles[100], even[100], .16) << "the nearest percent";
  EXPECT_GT(needles[100], .45);
}

TEST(Sample, CentroidsSpreadBetterThanJitterAndJitterThanRandom) {
  const TexturedMesh mesh = test::rectangle(.05, .05, 7, 7);
  const auto centroid = nearest_distances(sample(mesh, sample_options(6000, Sampler::kCentroid)));
  const auto jittered = nearest_distances(sample(mesh, sample_options(6000, Sampler::kJittered)));
  const auto random = nearest_distances(sample(mesh, sample_options(6000, Sampler::kRandom)));
  EXPECT_GT(mean(centroid), .78);
  EXPECT_GT(mean(centroid), mean(jittered) + .15);
  EXPECT_NEAR(mean(random), .5, .02) << "of a Poisson process";
  EXPECT_GT(mean(jittered), mean(random) + .03);
  EXPECT_GT(centroid.front(), .3) << "no two dots coincide";
}

TEST(Sample, RefusesWhatItCannotDo) {
  const TexturedMesh white = test::finish(test::sphere(.02));
  TexturedMesh blank = white;
  for (auto& corners : blank.corner_luminance) corners.fill(1);
  EXPECT_THROW(sample(blank, sample_options(100)), InputError);
  SampleOptions by_pitch;
  by_pitch.pitch_m = .001;
  EXPECT_TRUE(sample(blank, by_pitch).dots.empty()) << "white is what the paint is already";
  EXPECT_THROW(sample(white, SampleOptions{}), InputError);
  SampleOptions both = sample_options(100);
  both.pitch_m = .001;
  EXPECT_THROW(sample(white, both), InputError);
  SampleOptions many = sample_options(1000);
  many.dot_limit = 999;
  EXPECT_THROW(sample(white, many), InputError);
}

}  // namespace
}  // namespace hilbrush
