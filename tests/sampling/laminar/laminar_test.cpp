#include "sampling/laminar/laminar.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include "sampling/base/input_error.h"
#include "sampling/laminar/contours.h"
#include "tests/support/meshes.h"

namespace hilbrush {
namespace {

using test::kPi;

double length_of(const std::vector<Contour>& contours) {
  double length = 0;
  for (const Contour& contour : contours)
    for (const ContourPiece& piece : contour.pieces) length += piece.length();
  return length;
}

TEST(Contours, OfASphereAreClosedCirclesInOrder) {
  const TexturedMesh sphere = test::sphere(.025, 96, 48);
  const Slices slices(sphere, .001);
  ASSERT_GE(slices.count(), 50u);
  for (std::size_t k = 0; k < 50; ++k) {
    const auto contours = join(slices.pieces(k));
    ASSERT_EQ(contours.size(), 1u) << "slice " << k;
    EXPECT_TRUE(contours[0].is_closed);
    const auto& pieces = contours[0].pieces;
    for (std::size_t i = 0; i < pieces.size(); ++i)
      EXPECT_EQ(pieces[i].to_O, pieces[(i + 1) % pieces.size()].from_O)
          << "exactly: both come from the same edge";
    const double z = -.025 + (static_cast<double>(k) + .5) * .001, radius = std::sqrt(.025 * .025 - z * z);
    EXPECT_NEAR(length_of(contours), 2 * kPi * radius, .01 * 2 * kPi * radius) << "slice " << k;
    for (const ContourPiece& piece : pieces) EXPECT_NEAR(piece.from_O.z(), z, 1e-12);
  }
}

TEST(Contours, OpenOnesEndAtTheBoundary) {
  TexturedMesh wall = test::rectangle(.02, .03, 4, 6);
  for (auto& p : wall.vertices) p = {p.x(), 0, p.y()};
  const Slices slices(wall, .0011);
  for (std::size_t k = 0; k < 27; ++k) {
    const auto contours = join(slices.pieces(k));
    ASSERT_EQ(contours.size(), 1u);
    EXPECT_FALSE(contours[0].is_closed);
    EXPECT_NEAR(length_of(contours), .02, 1e-12);
  }
}

/// Planes that pass exactly through vertices and along edges still cut closed contours.
TEST(Contours, ThroughVertices) {
  const TexturedMesh sphere = test::sphere(.025, 24, 12);
  const Slices slices(sphere, .05);  // one plane, through the equator's ring of vertices
  const auto contours = join(slices.pieces(0));
  ASSERT_EQ(contours.size(), 1u);
  EXPECT_TRUE(contours[0].is_closed);
  EXPECT_NEAR(length_of(contours), 2 * kPi * .025, .01 * 2 * kPi * .025);
}

TEST(Contours, HostileMeshesAreCutWithoutLosingLength) {
  for (const auto& [name, mesh] : test::awkward_meshes()) {
    const Slices slices(mesh, .0013);
    std::size_t pieces = 0;
    for (std::size_t k = 0; k < slices.count(); ++k) {
      const auto of_slice = slices.pieces(k);
      double length = 0;
      for (const ContourPiece& piece : of_slice) length += piece.length();
      const auto contours = join(of_slice);
      EXPECT_NEAR(length_of(contours), length, 1e-12) << name << " slice " << k;
      for (const Contour& contour : contours) pieces += contour.pieces.size();
    }
    EXPECT_EQ(pieces, slices.piece_count()) << name;
  }
}

SampleOptions with_pitch(double pitch_m) {
  SampleOptions options;
  options.pitch_m = pitch_m;
  return options;
}
SampleOptions with_count(std::uint64_t count) {
  SampleOptions options;
  options.dot_count = count;
  return options;
}

TEST(Laminar, UprightWallsGetASquareGrid) {
  const TexturedMesh mesh = test::cylinder(.02, .05, 180, 20);
  const ToneField tone(mesh, {});
  const DotSequence dots = place_laminar(mesh, tone, with_pitch(.0005));
  EXPECT_NEAR(static_cast<double>(dots.dots.size()), mesh.area_m2() / .0005 / .0005, 5);
  for (std::size_t i = 1; i < dots.dots.size(); ++i) {
    EXPECT_GE(dots.dots[i].position_O.z(), dots.dots[i - 1].position_O.z() - 2e-5)
        << "upwards, but for the inset of dots";
    EXPECT_LT((dots.dots[i].position_O - dots.dots[i - 1].position_O).norm(), 2.5 * .0005)
        << "no jump at " << i;
  }
}

TEST(Laminar, CountIsExact) {
  const TexturedMesh mesh = test::sphere(.025, 96, 48);
  const ToneField tone(mesh, {});
  for (const std::uint64_t count : {1u, 2u, 100u, 12345u}) {
    SampleReport report;
    const DotSequence dots = place_laminar(mesh, tone, with_count(count), &report);
    ASSERT_EQ(dots.dots.size(), count);
    // The slices' mass on a sphere is pi/4 of its area: the mean of the sine of the slope.
    if (count > 1000) {
      const double expected = std::sqrt(mesh.area_m2() * kPi / 4 / static_cast<double>(count));
      EXPECT_NEAR(dots.pitch_m, expected, .02 * expected);
      EXPECT_GT(report.path_length_m, .5 * static_cast<double>(count) * dots.pitch_m);
    }
  }
}

TEST(Laminar, ToneIsDitheredAlongTheContours) {
  TexturedMesh wall = test::rectangle(.04, .04, 1, 1);
  for (auto& p : wall.vertices) p = {p.x(), 0, p.y()};
  const auto ramp = [](int i, int) { return (i + .5) / 64; };  // black on the left, white on the right
  const TexturedMesh mesh = test::with_texture(wall, 64, 1, ramp, false, false);
  const ToneField tone(mesh, {});
  const DotSequence dots = place_laminar(mesh, tone, with_pitch(.0002));
  EXPECT_NEAR(static_cast<double>(dots.dots.size()), 20'000, 400);
  double left = 0;
  for (const Dot& dot : dots.dots) left += dot.position_O.x() < .02;
  EXPECT_NEAR(left / static_cast<double>(dots.dots.size()), .75, .01);
}

std::string message_of(const std::function<void()>& act) {
  try {
    act();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

/// A tetrahedron of 60 mm, upright on a base of 60 nanometers, or lying with a base of .06 nanometers.
TexturedMesh needle(bool is_upright) {
  TexturedMesh mesh;
  const double base = is_upright ? 6e-8 : 6e-11;
  mesh.vertices = {{0, 0, 0}, {base, 0, 0}, {0, base, 0}, {0, 0, .06}};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
  if (!is_upright)
    for (auto& p : mesh.vertices) p = {p.z(), p.x(), p.y()};
  return test::finish(std::move(mesh));
}

TEST(Laminar, SlenderObjectsGetTheirCountOrAMessage) {
  for (const bool is_upright : {true, false}) {
    const TexturedMesh mesh = needle(is_upright);
    const ToneField tone(mesh, {});
    for (const SampleOptions& options : {with_count(500), with_pitch(.000254)}) {
      std::size_t count = 0;
      const std::string message = message_of([&] { count = place_laminar(mesh, tone, options).dots.size(); });
      EXPECT_TRUE(message.empty() ? count == options.dot_count
                                  : message.find("too small") != std::string::npos)
          << count << " dots, " << message;
    }
  }
}

TEST(Laminar, HorizontalFacesGetNothing) {
  const TexturedMesh plate = test::rectangle(.02, .02, 3, 3);
  const ToneField tone(plate, {});
  for (const SampleOptions& options : {with_pitch(.001), with_count(10)}) {
    const std::string message = message_of([&] { place_laminar(plate, tone, options); });
    EXPECT_NE(message.find("level"), std::string::npos) << message;
    EXPECT_EQ(message.find("blank"), std::string::npos) << "the plate is black: " << message;
  }
  const TexturedMesh cube = test::cube();
  const ToneField cube_tone(cube, {});
  for (const Dot& dot : place_laminar(cube, cube_tone, with_count(999)).dots)
    EXPECT_NEAR(dot.normal_O.z(), 0, 1e-6);
}

TEST(Laminar, HostileMeshesGetTheirCountOnTheSurface) {
  for (const auto& [name, mesh] : test::awkward_meshes()) {
    const ToneField tone(mesh, {});
    const auto [low, high] = bounds(mesh);
    if (high.z() - low.z() < 1e-9) continue;  // flat: no slice
    const DotSequence dots = place_laminar(mesh, tone, with_count(500));
    ASSERT_EQ(dots.dots.size(), 500u) << name;
    for (const Dot& dot : dots.dots) {
      const Eigen::Vector3d& corner = mesh.corner(dot.triangle, 0);
      EXPECT_NEAR((dot.position_O - corner).dot(mesh.area_vector(dot.triangle).normalized()), 0, 1e-9)
          << name;
      EXPECT_EQ(dot.level, 1);
    }
  }
}

TEST(Laminar, RefusesWhatPlaceDotsRefuses) {
  const TexturedMesh mesh = test::sphere(.025);
  const ToneField tone(mesh, {});
  SampleOptions both = with_count(5), few = with_count(10), fine = with_pitch(1e-9);
  both.pitch_m = .001;
  few.dot_limit = 9;
  EXPECT_THROW(place_laminar(mesh, tone, both), InputError);
  EXPECT_THROW(place_laminar(mesh, tone, SampleOptions{}), InputError);
  EXPECT_THROW(place_laminar(mesh, tone, few), InputError);
  EXPECT_THROW(place_laminar(mesh, tone, fine), InputError);
  EXPECT_THROW(place_laminar(mesh, tone, with_pitch(0)), InputError);
  EXPECT_THROW(place_laminar(mesh, tone, with_count(0)), InputError);
  const TexturedMesh blank = [] {
    TexturedMesh m = test::sphere(.025);
    for (auto& c : m.corner_luminance) c = {1, 1, 1};
    return m;
  }();
  const ToneField no_tone(blank, {});
  EXPECT_TRUE(place_laminar(blank, no_tone, with_pitch(.001)).dots.empty());
  EXPECT_THROW(place_laminar(blank, no_tone, with_count(3)), InputError);
}

TEST(Laminar, SameBytesForAnyNumberOfThreads) {
  const TexturedMesh mesh = test::torus();
  const ToneField tone(mesh, {});
  const auto place = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return place_laminar(mesh, tone, with_count(4000)).dots;
  };
  const auto one = place(1), three = place(3);
  for (std::size_t i = 0; i < one.size(); ++i) ASSERT_EQ(one[i].position_O, three[i].position_O);
}

}  // namespace
}  // namespace hilbrush
