#include "sampling/gaps/fill_holes.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "sampling/base/input_error.h"
#include "sampling/gaps/dot_grid.h"
#include "sampling/gaps/dot_path.h"
#include "sampling/gaps/voronoi_places.h"
#include "sampling/place_dots.h"
#include "tests/support/meshes.h"

namespace hilbrush {
namespace {

using Eigen::Vector3d;

DotSequence place(const SurfaceCurve& curve, const ToneField& tone, std::uint64_t count, Sampler sampler,
                  std::uint64_t seed = 1) {
  SampleOptions options;
  options.dot_count = count;
  options.sampler = sampler;
  options.seed = seed;
  return place_dots(curve, tone, options);
}

/// Distance to the nearest dot on the same side, by brute force.
double distance_to_dots(const std::vector<Dot>& dots, const Vector3d& place, const Vector3d& normal) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Dot& dot : dots)
    if (dot.normal_O.cast<double>().dot(normal) > kSameSide)
      nearest = std::min(nearest, (dot.position_O - place).squaredNorm());
  return std::sqrt(nearest);
}

/// visit(surface point) at the centers of the parts of all triangles, no part longer than `length_m`.
template <class Visit>
void probe(const TexturedMesh& mesh, double length_m, Visit visit) {
  for (std::uint32_t t = 0; t < mesh.triangle_count(); ++t) {
    double longest = 0;
    for (int c = 0; c < 3; ++c)
      longest = std::max(longest, (mesh.corner(t, c) - mesh.corner(t, (c + 1) % 3)).norm());
    const int parts = static_cast<int>(std::ceil(longest / length_m));
    for (int i = 0; i < parts; ++i)
      for (int j = 0; i + j < parts; ++j)
        visit(SurfacePoint{t, Vector3d(3 * i + 1, 3 * j + 1, 3 * (parts - i - j) - 2) / (3. * parts)});
  }
}

double largest_gap_m(const TexturedMesh& mesh, const std::vector<Dot>& dots, double pitch_m) {
  double largest = 0;
  probe(mesh, .4 * pitch_m, [&](const SurfacePoint& point) {
    largest = std::max(largest, distance_to_dots(dots, position(mesh, point), face_normal(mesh, point)));
  });
  return largest;
}

TEST(FillHoles, BoundsTheLargestGap) {
  const TexturedMesh mesh = test::sphere(.025, 48, 24);
  const ToneField tone(mesh, {});
  const SurfaceCurve curve(mesh);
  for (const Sampler sampler : {Sampler::kJittered, Sampler::kCentroid, Sampler::kRandom}) {
    const DotSequence before = place(curve, tone, 1500, sampler);
    std::uint64_t last_added = std::numeric_limits<std::uint64_t>::max();
    for (const double gap : {.8, 1., 1.3}) {
      FillReport report;
      const DotSequence filled = fill_holes(curve, tone, before, gap, &report);
      EXPECT_LE(largest_gap_m(mesh, filled.dots, before.pitch_m), gap * before.pitch_m)
          << "sampler " << static_cast<int>(sampler);
      EXPECT_EQ(filled.dots.size(), before.dots.size() + report.added);
      EXPECT_LE(report.added, last_added) << "a larger gap asks for fewer dots";
      EXPECT_LE(report.added_by_sweep, report.added);
      last_added = report.added;
    }
  }
}

TEST(FillHoles, FindsAHoleThatWasCut) {
  const TexturedMesh mesh = test::even_cylinder();
  const ToneField tone(mesh, {});
  const SurfaceCurve curve(mesh);
  DotSequence dots = place(curve, tone, 4000, Sampler::kCentroid);
  const double pitch = dots.pitch_m;
  const Vector3d middle(.02, 0, .025);
  std::erase_if(dots.dots, [&](const Dot& dot) { return (dot.position_O - middle).norm() < 6 * pitch; });
  const std::size_t left = dots.dots.size();
  EXPECT_GT(largest_gap_m(mesh, dots.dots, pitch), 5 * pitch);
  const DotSequence filled = fill_holes(curve, tone, dots, 1.1);
  EXPECT_LE(largest_gap_m(mesh, filled.dots, pitch), 1.1 * pitch);
  // At least A / (2.6 r^2) discs of radius r are needed to cover an area A; with centers at least r apart, at
  // most A / (.87 r^2) fit.
  const double area = test::kPi * 36;
  EXPECT_GT(static_cast<double>(filled.dots.size() - left), area / 2.6 / 1.21 * .8);
  EXPECT_LT(static_cast<double>(filled.dots.size() - left), area / .87 / 1.21);
}

TEST(FillHoles, KeepsTheOrderAndTheShortPath) {
  const TexturedMesh mesh = test::sphere(.025, 48, 24);
  const ToneField tone(mesh, {});
  const SurfaceCurve curve(mesh);
  const DotSequence before = place(curve, tone, 5000, Sampler::kJittered);
  const DotSequence after = fill_holes(curve, tone, before, 1);
  ASSERT_GT(after.dots.size(), before.dots.size());
  std::size_t next = 0;
  double length_before = 0, length_after = 0;
  for (std::size_t i = 0; i < after.dots.size(); ++i) {
    if (next < before.dots.size() && after.dots[i].position_O == before.dots[next].position_O) ++next;
    if (i > 0) length_after += (after.dots[i].position_O - after.dots[i - 1].position_O).norm();
  }
  EXPECT_EQ(next, before.dots.size()) << "the old dots are there, in their order";
  for (std::size_t i = 1; i < before.dots.size(); ++i)
    length_before += (before.dots[i].position_O - before.dots[i - 1].position_O).norm();
  const double added = static_cast<double>(after.dots.size() - before.dots.size());
  EXPECT_LT(length_after - length_before, 1.5 * before.pitch_m * added) << "far from a tour of its own";
  EXPECT_EQ(after.pitch_m, before.pitch_m);
}

TEST(FillHoles, NewDotsKeepTheirDistance) {
  const TexturedMesh mesh = test::sphere(.025, 48, 24);
  const ToneField tone(mesh, {});
  const SurfaceCurve curve(mesh);
  const DotSequence before = place(curve, tone, 2000, Sampler::kRandom);
  const DotSequence after = fill_holes(curve, tone, before, 1);
  for (const Dot& dot : after.dots) {
    const auto is_dot = [&](const Dot& other) { return other.position_O == dot.position_O; };
    if (std::any_of(before.dots.begin(), before.dots.end(), is_dot)) continue;
    double nearest = 1;
    for (const Dot& other : after.dots)
      if (!is_dot(other)) nearest = std::min(nearest, (other.position_O - dot.position_O).norm());
    EXPECT_GT(nearest, .96 * before.pitch_m);
  }
}

TEST(FillHoles, LightTonesHaveLargerGaps) {
  const TexturedMesh plain = test::rectangle(.05, .05, 6, 6);
  const TexturedMesh mesh = test::with_texture(
      plain, 64, 1, [](int i, int) { return .2 + .75 * i / 63; }, false, false);
  const ToneField tone(mesh, {});
  const SurfaceCurve curve(mesh);
  const DotSequence before = place(curve, tone, 1500, Sampler::kJittered);
  const DotSequence after = fill_holes(curve, tone, before, 1);
  double largest = 0;
  probe(mesh, .5 * before.pitch_m, [&](const SurfacePoint& point) {
    const double distance = distance_to_dots(after.dots, position(mesh, point), face_normal(mesh, point));
    largest = std::max(largest, distance * std::sqrt(tone.asked(point)) / before.pitch_m);
  });
  // Across a gap the tone is not even: the mean over the disc may be lighter than the middle's.
  EXPECT_LT(largest, 1.1);
  // The light and the dark part get new dots in proportion to their dots: a tenth more everywhere.
  const double added = static_cast<double>(after.dots.size() - before.dots.size());
  EXPECT_GT(added, 20);
  EXPECT_LT(added, 300);
}

TEST(FillHoles, WhiteAndNoiseGetNothing) {
  const TexturedMesh plain = test::rectangle(.05, .05, 6, 6);
  // White on the right half.
  const TexturedMesh half = test::with_texture(
      plain, 64, 1, [](int i, int) { return i < 32 ? 0. : 1.; }, false, false);
  const ToneField half_tone(half, {});
  const SurfaceCurve curve(half);
  for (const Dot& dot :
       fill_holes(curve, half_tone, place(curve, half_tone, 1000, Sampler::kJittered), .9).dots)
    EXPECT_LT(dot.position_O.x(), .026);
  // A tenth of the texels black, each a third of a pitch: the picture is a light gray, not black points to be
  // filled.
  const TexturedMesh noise = test::with_texture(
      plain, 200, 200, [](int i, int j) { return (i * 7 + j * 13 + i * j % 5) % 10 == 0 ? 0. : 1.; }, false,
      false);
  const ToneField noise_tone(noise, {});
  const SurfaceCurve noise_curve(noise);
  FillReport report;
  fill_holes(noise_curve, noise_tone, place(noise_curve, noise_tone, 450, Sampler::kCentroid), 1.5, &report);
  EXPECT_LT(report.added, 45u);
}

TEST(FillHoles, HostileMeshes) {
  for (const auto& [name, mesh] : test::awkward_meshes()) {
    const ToneField tone(mesh, {});
    const SurfaceCurve curve(mesh);
    const DotSequence before = place(curve, tone, 150, Sampler::kJittered);
    const DotSequence after = fill_holes(curve, tone, before, 1);
    EXPECT_LE(largest_gap_m(mesh, after.dots, before.pitch_m), before.pitch_m * 1.0001) << name;
    EXPECT_LT(after.dots.size(), 2 * before.dots.size()) << name;
  }
}

TEST(FillHoles, SameBytesForAnyNumberOfThreads) {
  const TexturedMesh mesh = test::torus();
  const ToneField tone(mesh, {});
  const SurfaceCurve curve(mesh);
  const DotSequence before = place(curve, tone, 3000, Sampler::kJittered);
  const auto fill = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return fill_holes(curve, tone, before, 1).dots;
  };
  const auto one = fill(1), three = fill(3);
  ASSERT_EQ(one.size(), three.size());
  for (std::size_t i = 0; i < one.size(); ++i) ASSERT_EQ(one[i].position_O, three[i].position_O);
}

TEST(FillHoles, RefusesGapsNoPlacementHas) {
  const TexturedMesh mesh = test::cube();
  const ToneField tone(mesh, {});
  const SurfaceCurve curve(mesh);
  EXPECT_THROW(fill_holes(curve, tone, {}, .3), InputError);
  EXPECT_THROW(fill_holes(curve, tone, {}, std::nan("")), InputError);
  EXPECT_TRUE(fill_holes(curve, tone, {}, 1).dots.empty());
}

TEST(VoronoiTriples, AreEquallyFarFromTheirVertex) {
  // A square and its middle: four vertices, each between the middle and two corners.
  const std::vector<Eigen::Vector2d> points{{.1, .1}, {.9, .1}, {.9, .9}, {.1, .9}, {.5, .5}, {.5, .5}};
  const auto triples = voronoi_triples(points, 1);
  ASSERT_EQ(triples.size(), 4u);
  for (const auto& triple : triples)
    EXPECT_EQ(std::count_if(triple.begin(), triple.end(), [](std::uint32_t i) { return i >= 4; }), 1);
  EXPECT_TRUE(voronoi_triples({}, 1).empty());
  EXPECT_TRUE(voronoi_triples(std::vector<Eigen::Vector2d>{{0, 0}, {1, 1}}, 1).empty());
}

}  // namespace
}  // namespace hilbrush
