#include "sampling/place_picture.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/meshes.h"

namespace hilbrush {
namespace {

double path_length_m(const DotSequence& dots) {
  double length = 0;
  for (std::size_t i = 1; i < dots.dots.size(); ++i)
    length += (dots.dots[i].position_O - dots.dots[i - 1].position_O).norm();
  return length;
}

void expect_path_of_returned_dots(const PictureOptions& options) {
  const TexturedMesh mesh = test::sphere(.025);
  const ToneOptions tone_options;
  const ToneField tone(mesh, tone_options);
  const SurfaceCurve curve(mesh);
  PictureReport report;
  const DotSequence dots = place_picture(curve, tone, tone_options, options, {}, &report);
  EXPECT_NEAR(report.path.path_length_m, path_length_m(dots), 1e-12);
  ASSERT_EQ(report.path.components.size(), 1u);
  EXPECT_EQ(report.path.components[0].dot_count, dots.dots.size());
  EXPECT_GT(report.path.path_constant, 0);
}

TEST(PlacePicture, MeasuresThePathWithTheDotsThatFillHoles) {
  PictureOptions options;
  options.sample.sampler = Sampler::kJittered;
  options.sample.dot_count = 3000;
  options.largest_gap_pitches = .9;
  expect_path_of_returned_dots(options);
}

TEST(PlacePicture, MeasuresThePathOfTheMovedDots) {
  PictureOptions options;
  options.sample.sampler = Sampler::kFine;
  options.sample.dot_count = 1000;
  options.fine_passes = 2;
  options.spot = [](double pitch_m) {
    return SpotModel{pitch_m, [](double dose) { return std::min(dose, 1.); }};
  };
  expect_path_of_returned_dots(options);
}

}  // namespace
}  // namespace hilbrush
