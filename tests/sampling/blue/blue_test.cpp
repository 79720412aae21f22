#include "sampling/blue/blue.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cstring>

#include "sampling/base/input_error.h"
#include "sampling/place_dots.h"
#include "sampling/quality/quality.h"
#include "tests/support/meshes.h"

namespace hilbrush {
namespace {

SampleOptions options_for(std::uint64_t count, Sampler sampler = Sampler::kBlue, std::uint64_t seed = 1) {
  SampleOptions options;
  options.dot_count = count;
  options.sampler = sampler;
  options.seed = seed;
  return options;
}

struct PaintedSurface {
  explicit PaintedSurface(TexturedMesh m) : mesh(std::move(m)), tone(mesh, {}), curve(mesh) {}
  DotSequence place(const SampleOptions& options, SampleReport* report = nullptr) const {
    return place_dots(curve, tone, options, report);
  }
  TexturedMesh mesh;
  ToneField tone;
  SurfaceCurve curve;
};

std::vector<Eigen::Vector2d> in_plane(const DotSequence& sequence) {
  std::vector<Eigen::Vector2d> points;
  for (const Dot& dot : sequence.dots) points.emplace_back(dot.position_O.head<2>());
  return points;
}

/// Black on the left, fading to a tenth on the right, with a white field in the middle.
TexturedMesh fading_picture() {
  return test::with_texture(test::rectangle(1, 1, 2, 2), 64, 64, [](int i, int j) {
    if (i > 24 && i < 40 && j > 24 && j < 40) return 1.f;
    return .9f * static_cast<float>(i) / 64;
  });
}

TEST(Blue, HasBlueNoiseInThePlane) {
  const PaintedSurface square(test::rectangle(1, 1, 2, 2));
  const std::uint64_t count = 20'000;
  const auto blue = in_plane(square.place(options_for(count))),
             jittered = in_plane(square.place(options_for(count, Sampler::kJittered)));
  const Spectrum spectrum = plane_spectrum(blue), rival = plane_spectrum(jittered);
  EXPECT_LE(spectrum.below_half, .02);
  EXPECT_GE(rival.below_half, .3) << "the control";
  EXPECT_LE(spectrum.anisotropy, rival.anisotropy + .1);
  EXPECT_GE(plane_spacing(blue).smallest, .5);
  // Centers on the border and in the corners count here, where a stratum has only one side to keep its dot
  // from.
  EXPECT_LE(plane_largest_hole(blue), 1.1);
  EXPECT_LT(plane_discrepancies(blue)[1].rms, plane_discrepancies(jittered)[1].rms);
}

/// One pair in 100,000 that is pushed together by others is still one.
TEST(Blue, NoPairOfManyIsTooNear) {
  const PaintedSurface square(test::rectangle(1, 1, 2, 2));
  EXPECT_GE(plane_spacing(in_plane(square.place(options_for(100'000)))).smallest, .55);
}

TEST(Blue, KeepsDotsApartOnAClosedSurface) {
  const PaintedSurface sphere(test::sphere(.03, 96, 48));
  const DotSequence dots = sphere.place(options_for(8'000));
  const SurfaceQuality quality(sphere.mesh);
  EXPECT_GE(quality.spacing(dots.dots).smallest, .5);
  EXPECT_LE(quality.largest_hole(dots.dots), 1.);
  for (const Dot& dot : dots.dots) {
    const Eigen::Vector3d& a = sphere.mesh.corner(dot.triangle, 0);
    EXPECT_NEAR((dot.position_O - a).dot(sphere.mesh.area_vector(dot.triangle).normalized()), 0, 1e-9);
  }
}

TEST(Blue, TwoSidesOfAThinPlateDoNotPushEachOther) {
  // Two squares back to back, a hundredth of a spacing apart.
  const double gap = 1e-4;
  TexturedMesh upper = test::rectangle(1, 1, 2, 2), lower = upper;
  for (Eigen::Vector3d& p : upper.vertices) p.z() = gap;
  for (auto& triangle : lower.triangles) std::swap(triangle[1], triangle[2]);
  const PaintedSurface plate(test::both(upper, lower));
  const DotSequence dots = plate.place(options_for(8'000));
  const SurfaceQuality quality(plate.mesh);
  EXPECT_GE(quality.spacing(dots.dots).smallest, .45);
  EXPECT_LE(quality.largest_hole(dots.dots), 1.1);
}

TEST(Blue, KeepsDotsApartOverASharpFold) {
  const PaintedSurface sheet(test::folded_sheet(1, .5, 4, 4));
  const DotSequence dots = sheet.place(options_for(8'000));
  const SurfaceQuality quality(sheet.mesh);
  EXPECT_GE(quality.spacing(dots.dots).smallest, .45);
  EXPECT_LE(quality.largest_hole(dots.dots), 1.1);
}

TEST(Blue, FollowsTheTone) {
  const PaintedSurface picture(fading_picture());
  const DotSequence dots = picture.place(options_for(6'000));
  ASSERT_EQ(dots.dots.size(), 6'000u);
  const SurfaceQuality quality(picture.mesh, &picture.tone);
  const DotSequence jittered = picture.place(options_for(6'000, Sampler::kJittered));
  EXPECT_GT(quality.spacing(dots.dots).smallest, 3 * quality.spacing(jittered.dots).smallest);
  EXPECT_GT(quality.spacing(dots.dots).smallest, .2);
  for (const Dot& dot : dots.dots) {
    EXPECT_GT(dot.tone, 0);
    EXPECT_EQ(dot.position_O.z(), 0);
  }
}

TEST(Blue, EachDotIsInItsStratum) {
  const PaintedSurface picture(fading_picture());
  const std::uint64_t count = 2'000, places = 8;
  const DotSequence dots = picture.place(options_for(count)),
                    even = picture.place(options_for(places * count, Sampler::kEven));
  for (std::uint64_t i = 0; i < count; ++i) {
    double nearest = 1e300;
    for (std::uint64_t p = 0; p < places; ++p)
      nearest = std::min(nearest, (dots.dots[i].position_O - even.dots[places * i + p].position_O).norm());
    const double spacing = dots.pitch_m / std::sqrt(std::max(.02f, dots.dots[i].tone));
    EXPECT_LE(nearest, .4 * spacing) << "dot " << i;
  }
}

TEST(Blue, SameBytesForAnyNumberOfThreads) {
  const PaintedSurface picture(fading_picture());
  std::vector<DotSequence> results;
  for (const std::size_t threads : {1u, 4u}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    results.push_back(picture.place(options_for(5'000)));
  }
  for (std::size_t i = 0; i < results[0].dots.size(); ++i)
    ASSERT_EQ(std::memcmp(results[0].dots[i].position_O.data(), results[1].dots[i].position_O.data(),
                          3 * sizeof(double)),
              0)
        << "dot " << i;
}

TEST(Blue, CountsAndReportsAsTheOthersDo) {
  const PaintedSurface picture(fading_picture());
  SampleOptions options;
  options.pitch_m = .02;
  SampleReport report, report_of_centroid;
  const DotSequence centroid = picture.place(options, &report_of_centroid);
  options.sampler = Sampler::kBlue;
  const DotSequence blue = picture.place(options, &report);
  EXPECT_EQ(blue.dots.size(), centroid.dots.size());
  EXPECT_EQ(blue.pitch_m, centroid.pitch_m);
  EXPECT_GT(report.path_length_m, report_of_centroid.path_length_m);
  EXPECT_LT(report.path_constant, 1.4 * report_of_centroid.path_constant);

  EXPECT_EQ(picture.place(options_for(1)).dots.size(), 1u);
  EXPECT_NEAR(picture.place(options_for(500)).pitch_m,
              picture.place(options_for(500, Sampler::kCentroid)).pitch_m, 1e-9);
}

TEST(Blue, NothingToPaintIsNoError) {
  TexturedMesh mesh = test::rectangle(1, 1, 1, 1);
  for (auto& corners : mesh.corner_luminance) corners = {1, 1, 1};
  const PaintedSurface blank(std::move(mesh));
  SampleOptions options;
  options.sampler = Sampler::kBlue;
  options.pitch_m = .01;
  EXPECT_TRUE(blank.place(options).dots.empty());
  EXPECT_THROW(blank.place(options_for(100)), InputError);
  options.dot_count = 5;
  EXPECT_THROW(blank.place(options), InputError) << "both pitch and count";
}

}  // namespace
}  // namespace hilbrush
