#include "sim/film/views.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <string>

#include "sampling/images/image_file.h"
#include "sim/film/canvas.h"
#include "tests/sim/test_objects.h"
#include "tests/support/temporary_folder.h"

namespace hilbrush {
namespace {

using Eigen::Vector3d;

/// A cube of side 2 around (0, 0, 1) that stands on the plate, every face white.
TexturedMesh cube() {
  TexturedMesh mesh;
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {-1., 1.}) {
      const Vector3d n = sign * Vector3d::Unit(axis);
      const Vector3d u = Vector3d::Unit((axis + 1) % 3);
      const Vector3d v = n.cross(u);
      const Vector3d middle = n + Vector3d::UnitZ();
      test::add_quad(mesh, {middle - u - v, middle + u - v, middle + u + v, middle - u + v}, 1);
    }
  return mesh;
}

/// Where each view is expected to show its top left corner, and the corner to the right of it: written down
/// from what the header promises.
const std::map<std::string, std::pair<Vector3d, Vector3d>> kTopCorners{
    {"front", {{-1, -1, 2}, {1, -1, 2}}}, {"right", {{1, -1, 2}, {1, 1, 2}}},
    {"back", {{1, 1, 2}, {-1, 1, 2}}},    {"left", {{-1, 1, 2}, {-1, -1, 2}}},
    {"top", {{-1, 1, 2}, {1, 1, 2}}},     {"bottom", {{-1, -1, 0}, {1, -1, 0}}}};

TEST(OrthographicView, EveryPictureIsUprightAndUnmirrored) {
  const TexturedMesh mesh = cube();
  for (const ViewDirection& direction : picture_views()) {
    const OrthographicView view(mesh, direction, .02);
    const auto& [top_left, top_right] = kTopCorners.at(direction.name);
    const Vector3d middle(0, 0, 1);
    const auto left = view.pixel_of(middle + .98 * (top_left - middle), .1);
    const auto right = view.pixel_of(middle + .98 * (top_right - middle), .1);
    ASSERT_TRUE(left && right) << direction.name;
    EXPECT_LT(left->x(), 5) << direction.name;
    EXPECT_LT(left->y(), 5) << direction.name;
    EXPECT_GT(right->x(), view.width() - 6) << direction.name;
    EXPECT_LT(right->y(), 5) << direction.name;
  }
}

TEST(OrthographicView, ShowsTheNearestFaceAndTheRightPlaceOnIt) {
  const TexturedMesh mesh = test::ball(.01, 40);
  const OrthographicView view(mesh, picture_views()[0], 1e-4, 3);
  int film = 0;
  std::vector<OrthographicView::Pixel> row;
  for (int y = 0; y < view.height(); ++y) {
    view.read_row(y, row);
    for (int x = 0; x < view.width(); ++x) {
      EXPECT_NE(row[x].side, OrthographicView::Side::kBack);
      if (row[x].side != OrthographicView::Side::kFront) continue;
      ++film;
      const Vector3d p_O = position(mesh, row[x].point);
      EXPECT_LT(p_O.y(), 1e-4);
      const auto pixel = view.pixel_of(p_O, 1e-4);
      ASSERT_TRUE(pixel);
      // Places on the border of a pixel may round to its neighbor.
      EXPECT_LE((*pixel - Eigen::Vector2i(x, y)).cwiseAbs().maxCoeff(), 1);
      EXPECT_EQ(view.pixel(x, y).point.triangle, row[x].point.triangle);
    }
  }
  EXPECT_NEAR(film * 1e-8, std::numbers::pi * 1e-4, .01 * std::numbers::pi * 1e-4);  // the disk of the sphere
  EXPECT_FALSE(view.pixel_of({0, .02, .01}, 1e-4));                                  // behind it
}

TEST(OrthographicView, AFaceSeenFromBehindIsNoFilm) {
  const TexturedMesh mesh = test::square(.01);
  const auto views = picture_views();
  const OrthographicView top(mesh, views[4], 1e-3), bottom(mesh, views[5], 1e-3);
  EXPECT_EQ(top.pixel(5, 5).side, OrthographicView::Side::kFront);
  EXPECT_EQ(bottom.pixel(5, 5).side, OrthographicView::Side::kBack);
}

class Pictures : public ::testing::Test {
 protected:
  testing_support::TemporaryFolder folder_;
};

TEST_F(Pictures, ShowWantedPaintedAndErrorWhereTheyAre) {
  // A wall facing the front, its upper left quarter black.
  const CellDescription cell = test::handmade_cell();
  TexturedMesh mesh;
  const double r = .02;
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 2; ++j) {
      const double x = (i - 1) * r;
      const double z = j * r;
      test::add_quad(mesh, {Vector3d{x, 0, z}, {x + r, 0, z}, {x + r, 0, z + r}, {x, 0, z + r}},
                     i == 0 && j == 1 ? 0.f : 1.f);
    }
  const ToneField tone(mesh, {});
  const Film film(mesh, cell, 1e-3);
  const std::vector<Vector3d> skipped{{r / 2, 0, r / 2}};
  const auto files = write_pictures(film, tone, skipped, folder_.path());
  ASSERT_EQ(files.size(), 7u);
  for (const auto& file : files) EXPECT_TRUE(std::filesystem::is_regular_file(file)) << file;
  EXPECT_EQ(files[0], folder_ / "views" / "front.png");
  EXPECT_EQ(files[6], folder_ / "exposure.png");

  const auto front = load_image_file(files[0], 10'000'000);
  ASSERT_TRUE(front) << front.reason();
  // Black in the left panel (wanted) only: nothing is painted. Row 0 of a Texture is the bottom.
  double x_mean = 0;
  double y_mean = 0;
  int black = 0;
  int black_elsewhere = 0;
  for (int y = 0; y < front->height; ++y)
    for (int x = 0; x < front->width; ++x) {
      if (front->luminance[static_cast<std::size_t>(y) * front->width + x] > .002) continue;
      (x < front->width / 3 ? black : black_elsewhere) += 1;
      x_mean += x;
      y_mean += y;
    }
  EXPECT_GT(black, 1000);
  EXPECT_EQ(black_elsewhere, 0);
  EXPECT_LT(x_mean / black, front->width / 6.);
  EXPECT_GT(y_mean / black, front->height / 2.);
}

TEST(Canvas, WritesWhatCanBeReadAndCutsOffTheRest) {
  Canvas canvas(12, 9, {0, 0, 0});
  canvas.write(1, 1, "L", 1, {255, 255, 255});
  const auto lit = [&](int x, int y) {
    return canvas.picture().pixels[static_cast<std::size_t>(y * 12 + x) * 3] == 255;
  };
  for (int y = 1; y <= 7; ++y) EXPECT_TRUE(lit(1, y));
  for (int x = 1; x <= 5; ++x) EXPECT_TRUE(lit(x, 7));
  EXPECT_FALSE(lit(3, 3));
  canvas.write(9, 5, "WWW~\xff", 3, {255, 0, 0});
  canvas.mark(-5, 100, 200, {1, 2, 3});
}

}  // namespace
}  // namespace hilbrush
