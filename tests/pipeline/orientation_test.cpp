#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>

#include "tests/pipeline/painting.h"

/// A letter on each face of a cube, read back from the film: a picture that is turned, mirrored, or on the
/// wrong face cannot pass. What the test knows is the cube as tests/data/make_cubes.py describes it, and the
/// rule that texture coordinates start at the image's lower left corner in VRML97 (6.46), OBJ and PLY alike.
/// It looks at the film through a plain box of its own: no reader, no texture and no sampling is trusted.
namespace hilbrush::testing_pipeline {
namespace {

constexpr double kSide_m = .02;
constexpr int kGrid = 48;  ///< a face is read at kGrid x kGrid places; row 0 is the bottom

using Bitmap = std::vector<double>;  ///< darkness 0..1 at the places of a face, row after row

struct Stroke {
  double x0, y0, x1, y1;
};

/// One tile of letter_cube.png as strokes, in pixels from the tile's upper left corner: the letter, and the
/// face's number beside it.
constexpr double kTilePixels = 96;
const std::vector<Stroke> kLetter{{18, 80, 18, 16}, {18, 16, 56.4, 16}, {18, 46.7, 46.8, 46.7}};
const std::array<std::vector<Stroke>, 6> kNumbers{{
    {{66, 60.5, 71.2, 54}, {71.2, 54, 71.2, 80}},
    {{66, 59, 70, 54.5}, {70, 54.5, 76, 54.5}, {76, 54.5, 79, 63}, {79, 63, 66, 80}, {66, 80, 80.3, 80}},
    {{67, 57, 72.5, 54},
     {72.5, 54, 79, 60},
     {79, 60, 73, 66.5},
     {73, 66.5, 80, 73.5},
     {80, 73.5, 73, 80},
     {73, 80, 66.5, 77}},
    {{76.9, 80, 76.9, 54}, {76.9, 54, 66, 72.2}, {66, 72.2, 81.6, 72.2}},
    {{79, 54, 67.5, 54},
     {67.5, 54, 66.8, 65.7},
     {66.8, 65.7, 74, 64},
     {74, 64, 80, 71.8},
     {80, 71.8, 74, 80},
     {74, 80, 66.8, 77}},
    {{77.7, 54.8, 69, 60},
     {69, 60, 66, 70},
     {66, 70, 67, 77},
     {67, 77, 73.3, 80},
     {73.3, 80, 80.5, 72.5},
     {80.5, 72.5, 73.3, 65},
     {73.3, 65, 67, 69}},
}};

double distance(const Stroke& s, double x, double y) {
  const double dx = s.x1 - s.x0;
  const double dy = s.y1 - s.y0;
  const double t = std::clamp(((x - s.x0) * dx + (y - s.y0) * dy) / (dx * dx + dy * dy), 0., 1.);
  return std::hypot(x - s.x0 - t * dx, y - s.y0 - t * dy);
}

/// What a face should look like: right and up as its viewer sees them.
Bitmap drawn(const std::vector<Stroke>& strokes, double width_pixels) {
  Bitmap bitmap;
  for (int row = 0; row < kGrid; ++row) {
    for (int column = 0; column < kGrid; ++column) {
      const double x = kTilePixels * (column + .5) / kGrid;
      const double y = kTilePixels * (1 - (row + .5) / kGrid);
      const bool is_dark = std::any_of(strokes.begin(), strokes.end(), [&](const Stroke& s) {
        return distance(s, x, y) <= width_pixels / 2;
      });
      bitmap.push_back(is_dark ? 1 : 0);
    }
  }
  return bitmap;
}

/// The eight ways a square picture can lie on a square: 0 as it should; 1, 2, 3 turned by quarters; 4..7 the
/// same, mirrored.
Bitmap transformed(const Bitmap& bitmap, int variant) {
  Bitmap result(bitmap.size());
  for (int row = 0; row < kGrid; ++row) {
    for (int column = 0; column < kGrid; ++column) {
      int r = row;
      int c = variant >= 4 ? kGrid - 1 - column : column;
      for (int turn = 0; turn < variant % 4; ++turn) {
        const int old_r = r;
        r = c;
        c = kGrid - 1 - old_r;
      }
      result[static_cast<std::size_t>(r * kGrid + c)] =
          bitmap[static_cast<std::size_t>(row * kGrid + column)];
    }
  }
  return result;
}

/// Pearson's correlation over the places that `is_counted` (all if empty).
double correlation(const Bitmap& a, const Bitmap& b, const std::vector<bool>& is_counted = {}) {
  double n = 0;
  double sum_a = 0;
  double sum_b = 0;
  double aa = 0;
  double bb = 0;
  double ab = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (!is_counted.empty() && !is_counted[i]) continue;
    n += 1;
    sum_a += a[i];
    sum_b += b[i];
    aa += a[i] * a[i];
    bb += b[i] * b[i];
    ab += a[i] * b[i];
  }
  const double variance = (n * aa - sum_a * sum_a) * (n * bb - sum_b * sum_b);
  return variance > 0 ? (n * ab - sum_a * sum_b) / std::sqrt(variance) : 0;
}

struct Face {
  const char* name;
  Eigen::Vector3d normal_F, right_F, up_F;  ///< file axes of VRML and OBJ, y up
};
/// In the order of their numbers, 1 to 6.
const std::array<Face, 6> kFaces{{
    {"front", {0, 0, 1}, {1, 0, 0}, {0, 1, 0}},
    {"right", {1, 0, 0}, {0, 0, -1}, {0, 1, 0}},
    {"back", {0, 0, -1}, {-1, 0, 0}, {0, 1, 0}},
    {"left", {-1, 0, 0}, {0, 0, 1}, {0, 1, 0}},
    {"top", {0, 1, 0}, {1, 0, 0}, {0, 0, -1}},
    {"bottom", {0, -1, 0}, {1, 0, 0}, {0, 0, 1}},
}};

/// The cube's PLY file has z up: the same cube, turned.
Eigen::Vector3d in_file_axes(const Eigen::Vector3d& v, bool is_z_up) {
  return is_z_up ? Eigen::Vector3d(v.x(), -v.z(), v.y()) : v;
}

/// The film over one face as its viewer sees it.
Bitmap read_face(const Film& film, const Eigen::Vector3d& normal_O, const Eigen::Vector3d& right_O,
                 const Eigen::Vector3d& up_O) {
  const Eigen::Vector3d middle_O(0, 0, kSide_m / 2);
  Bitmap bitmap;
  for (int row = 0; row < kGrid; ++row) {
    for (int column = 0; column < kGrid; ++column) {
      const double right = (column + .5) / kGrid - .5;
      const double up = (row + .5) / kGrid - .5;
      const Eigen::Vector3d p_O = middle_O + kSide_m * (.5 * normal_O + right * right_O + up * up_O);
      bitmap.push_back(film.painted(nearest_point(film.mesh(), p_O)));
    }
  }
  return bitmap;
}

struct Reading {
  bool is_painted = false;
  double as_it_should = 0;  ///< correlation with the letter, upright and unmirrored ...
  double best_other = 0;    ///< ... and of the best other variant
  int best_variant = 0;
  int number = 0;  ///< the number that fits best
};

Reading read_letter(const Bitmap& bitmap) {
  static const Bitmap letter = drawn(kLetter, 11);
  Reading reading;
  reading.is_painted =
      std::accumulate(bitmap.begin(), bitmap.end(), 0.) / static_cast<double>(bitmap.size()) > .03;
  double best = -1;
  for (int variant = 0; variant < 8; ++variant) {
    const double fit = correlation(bitmap, transformed(letter, variant));
    if (variant == 0) reading.as_it_should = fit;
    if (variant != 0) reading.best_other = std::max(reading.best_other, fit);
    if (fit <= best) continue;
    best = fit;
    reading.best_variant = variant;
  }
  // The number's corner: right of the letter, below its middle.
  std::vector<bool> is_corner;
  for (int row = 0; row < kGrid; ++row)
    for (int column = 0; column < kGrid; ++column)
      is_corner.push_back(column > .62 * kGrid && row < .5 * kGrid);
  best = -1;
  for (std::size_t k = 0; k < kNumbers.size(); ++k) {
    const double fit = correlation(bitmap, drawn(kNumbers[k], 5), is_corner);
    if (fit <= best) continue;
    best = fit;
    reading.number = static_cast<int>(k) + 1;
  }
  return reading;
}

/// Paints the cube with `up` as its upward axis and reads every face. Returns the numbers of the faces that
/// were painted.
std::vector<int> paint_and_read(const std::string& file, const char* up) {
  JobSettings settings;
  settings.size_mm = kSide_m * 1e3;
  settings.dpi = 100;
  settings.up = up;
  const Painting painting = paint_model(test_data(file), settings);
  const FileToObject placed = file_to_object(test_data(file), settings);

  const TexturedMesh box = plain_box(Eigen::Vector3d::Constant(kSide_m));
  Film film(box, painting.cell, painting.program.pitch_m);
  film.expose(painting.emissions);

  std::vector<int> painted;
  for (std::size_t k = 0; k < kFaces.size(); ++k) {
    const auto in_object = [&](const Eigen::Vector3d& v) -> Eigen::Vector3d {
      return placed.R_OF * in_file_axes(v, file.ends_with(".ply"));
    };
    const Eigen::Vector3d normal_O = in_object(kFaces[k].normal_F);
    const Reading reading =
        read_letter(read_face(film, normal_O, in_object(kFaces[k].right_F), in_object(kFaces[k].up_F)));
    // The face that the cube stands on is reached from below as far as the table tilts: what is there must be
    // right, but needs not be there.
    const bool is_underside = normal_O.z() < -.5;
    EXPECT_TRUE(reading.is_painted || is_underside) << file << ", " << up << " up: " << kFaces[k].name;
    if (!reading.is_painted) continue;
    painted.push_back(static_cast<int>(k) + 1);
    EXPECT_EQ(reading.best_variant, 0) << file << ", " << up << " up: the letter on the " << kFaces[k].name
                                       << " lies in variant " << reading.best_variant;
    if (is_underside) continue;
    EXPECT_GT(reading.as_it_should, .75) << file << ", " << up << " up: " << kFaces[k].name;
    EXPECT_GT(reading.as_it_should, reading.best_other + .3)
        << file << ", " << up << " up: " << kFaces[k].name;
    EXPECT_EQ(reading.number, static_cast<int>(k) + 1)
        << file << ", " << up << " up: the " << kFaces[k].name << " shows another face's picture";
  }
  return painted;
}

class Orientation : public testing::TestWithParam<const char*> {};

TEST_P(Orientation, LettersStandUprightAndUnmirroredOnEveryFace) {
  // Standing as the format has it, and tipped over: together every face is painted once at least.
  std::vector<int> painted = paint_and_read(GetParam(), "y");
  EXPECT_GE(painted.size(), 5u);
  const std::vector<int> tipped = paint_and_read(GetParam(), "z");
  EXPECT_GE(tipped.size(), 5u);
  painted.insert(painted.end(), tipped.begin(), tipped.end());
  for (int k = 1; k <= 6; ++k)
    EXPECT_NE(std::find(painted.begin(), painted.end(), k), painted.end())
        << "face " << k << " was never painted";
}

INSTANTIATE_TEST_SUITE_P(Formats, Orientation,
                         testing::Values("letter_cube.wrl", "letter_cube.obj", "letter_cube.ply"),
                         [](const auto& each) {
                           return std::string(each.param).substr(std::string("letter_cube.").size());
                         });

TEST(OrientationTest, WouldSeeEveryOtherWay) {
  // This tests the test itself: a letter that lies in any of the other seven ways, or another number, is
  // distinguished from the right one.
  for (int variant = 0; variant < 8; ++variant) {
    std::vector<Stroke> strokes = kLetter;
    Bitmap bitmap = drawn(strokes, 11);
    const Bitmap number = drawn(kNumbers[3], 5);
    for (std::size_t i = 0; i < bitmap.size(); ++i) bitmap[i] = std::max(bitmap[i], number[i]);
    const Reading reading = read_letter(transformed(bitmap, variant));
    EXPECT_EQ(reading.best_variant, variant);
    if (variant == 0) {
      EXPECT_EQ(reading.number, 4);
    } else {
      EXPECT_LT(reading.as_it_should, .6) << "variant " << variant;
    }
  }
}

TEST(Colors, EachFaceIsPaintedInItsOwnGray) {
  // face_colors.wrl: colorIndex [3 1 4 0 2 5] of the grays 0, .2, .4, .6, .8, 1, sRGB-encoded, for the faces
  // in the order above.
  JobSettings settings;
  settings.size_mm = kSide_m * 1e3;
  settings.dpi = 100;
  const Painting painting = paint_model(test_data("face_colors.wrl"), settings);
  const FileToObject placed = file_to_object(test_data("face_colors.wrl"), settings);
  const TexturedMesh box = plain_box(Eigen::Vector3d::Constant(kSide_m));
  Film film(box, painting.cell, painting.program.pitch_m);
  film.expose(painting.emissions);
  const std::array<double, 6> grays{.6, .2, .8, 0, .4, 1};
  for (std::size_t k = 0; k + 1 < kFaces.size(); ++k) {  // the last one is the bottom
    const Bitmap bitmap = read_face(film, placed.R_OF * kFaces[k].normal_F, placed.R_OF * kFaces[k].right_F,
                                    placed.R_OF * kFaces[k].up_F);
    double sum = 0;
    int count = 0;
    for (int row = 6; row < kGrid - 6; ++row)
      for (int column = 6; column < kGrid - 6; ++column)
        sum += bitmap[static_cast<std::size_t>(row * kGrid + column)], ++count;
    const double linear = grays[k] <= .04045 ? grays[k] / 12.92 : std::pow((grays[k] + .055) / 1.055, 2.4);
    EXPECT_NEAR(sum / count, 1 - linear, .08) << kFaces[k].name;
  }
}

}  // namespace
}  // namespace hilbrush::testing_pipeline
