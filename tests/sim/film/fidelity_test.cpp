#include "sim/film/fidelity.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>

#include "tests/sim/test_objects.h"

namespace hilbrush {
namespace {

constexpr double kPitch = .5e-3, kSide = .04, kMargin = .008;

/// A square of one wanted tone under paint of linear response, evenly painted with `painted` by weak spots
/// half a pitch apart.
struct EvenPicture {
  EvenPicture(double wanted, double painted)
      : cell(linear_cell()),
        mesh(test::square(kSide, 0, static_cast<float>(1 - wanted))),
        tone(mesh, {}),
        film(mesh, cell, kPitch) {
    std::vector<SurfacePoint> points;
    const int n = static_cast<int>(2 * kSide / kPitch);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        const double u = (i + .5) / n;
        const double v = (j + .5) / n;
        points.push_back(u >= v ? SurfacePoint{0, {1 - u, u - v, v}} : SurfacePoint{1, {1 - v, u, v - u}});
      }
    film.expose_at(points, std::vector<float>(points.size(), static_cast<float>(painted / 4)));
  }
  static CellDescription linear_cell() {
    CellDescription cell = test::handmade_cell();
    cell.paint.response = PaintResponse::kLinear;
    return cell;
  }
  /// Away from the border, over which light is lost.
  static bool is_inside(const Eigen::Vector3d& p_O) {
    return p_O.head<2>().cwiseAbs().maxCoeff() < kSide / 2 - kMargin;
  }
  Fidelity measure() const {
    return measure_fidelity(
        film, tone, [this](const SurfacePoint& point) { return is_inside(position(mesh, point)); }, 1);
  }

  CellDescription cell;
  TexturedMesh mesh;
  ToneField tone;
  Film film;
};

TEST(Fidelity, AnEvenPictureOfTheWantedToneHasAlmostNoError) {
  const EvenPicture picture(.4, .4);
  const Fidelity fidelity = picture.measure();
  EXPECT_GT(fidelity.reachable.f1_db, 50);
  EXPECT_GT(fidelity.reachable.f2_db, 55);
  EXPECT_GT(fidelity.reachable.s2, .999);
  EXPECT_LT(fidelity.reachable.tone_max, .002);
  EXPECT_LT(fidelity.reachable.p999, .003);
  EXPECT_LT(fidelity.whole.f2_db, fidelity.reachable.f2_db - 5);  // the border is too light
  const double inside = std::pow(1 - 2 * kMargin / kSide, 2);
  EXPECT_NEAR(fidelity.unreachable_share, 1 - inside, .01);
}

TEST(Fidelity, AConstantErrorHasTheFiguresOfItsClosedForm) {
  const EvenPicture picture(.4, .5);
  const FidelityFigures figures = picture.measure().reachable;
  EXPECT_NEAR(figures.f1_db, 20, .1);  // -10 log10(.1^2)
  EXPECT_NEAR(figures.f2_db, 20, .1);
  EXPECT_NEAR(figures.tone_rms, .1, .001);
  EXPECT_NEAR(figures.tone_max, .1, .001);
  EXPECT_NEAR(figures.p999, .1, .002);
  const double a = .4;
  const double b = .5;
  const double c1 = 1e-4;
  EXPECT_NEAR(figures.s2, (2 * a * b + c1) / (a * a + b * b + c1), .002);
}

TEST(Fidelity, ABlankPictureOfBlankSurfaceIsIdentical) {
  const CellDescription cell = test::handmade_cell();
  const TexturedMesh mesh = test::square(.02, 0, 1);
  const ToneField tone(mesh, {});
  const Film film(mesh, cell, kPitch);
  const Fidelity fidelity = measure_fidelity(film, tone, {}, 1);
  EXPECT_EQ(fidelity.whole.f1_db, 99);
  EXPECT_EQ(fidelity.whole.f2_db, 99);
  EXPECT_NEAR(fidelity.whole.s2, 1, 1e-6);
  EXPECT_EQ(fidelity.unreachable_share, 0);
}

TEST(Fidelity, NothingReachableGivesNoFigures) {
  const CellDescription cell = test::handmade_cell();
  const TexturedMesh mesh = test::square(.02);
  const ToneField tone(mesh, {});
  const Film film(mesh, cell, kPitch);
  const Fidelity fidelity = measure_fidelity(
      film, tone, [](const SurfacePoint&) { return false; }, 1);
  EXPECT_EQ(fidelity.unreachable_share, 1);
  EXPECT_EQ(fidelity.reachable.f1_db, 0);
  EXPECT_EQ(fidelity.reachable.s2, 0);
  EXPECT_NEAR(fidelity.whole.f1_db, 0, 1e-6);  // all black is wanted, all blank: an error of 1
}

TEST(Fidelity, TheSameFiguresForAnyNumberOfThreads) {
  const EvenPicture picture(.3, .35);
  FidelityFigures first;
  for (const int threads : {1, 2, 5}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    const FidelityFigures figures = picture.measure().whole;
    if (threads == 1) first = figures;
    EXPECT_EQ(figures.f1_db, first.f1_db);
    EXPECT_EQ(figures.f2_db, first.f2_db);
    EXPECT_EQ(figures.s2, first.s2);
    EXPECT_EQ(figures.p999, first.p999);
  }
}

}  // namespace
}  // namespace hilbrush
