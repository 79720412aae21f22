#include "sim/film/film.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <random>

#include "sampling/base/angles.h"
#include "sim/film/beam.h"
#include "tests/sim/test_objects.h"

namespace hilbrush {
namespace {

using test::handmade_cell;
using test::square;
using test::visit_surface;

constexpr double kCellPitch = .254e-3;

/// Joints whose beam has its focus at p_O and travels along direction_W's yaw, with the table level: solved
/// here from the frame comment.
Joints joints_for(const CellDescription& cell, const Eigen::Vector3d& p_O, double yaw, double tilt = 0,
                  double rotation = 0) {
  const Eigen::AngleAxisd tilted(-tilt, Eigen::Vector3d::UnitY()), turned(rotation, Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d focus_W =
      cell.table.tilt_axis_W +
      tilted * (Eigen::Vector3d(0, 0, cell.table.plate_height_m + cell.fixture.post_height_m) + turned * p_O);
  const double e = cell.arm.beam_depression;
  const Eigen::Vector3d flange =
      focus_W - cell.arm.flange_to_focus_m *
                    Eigen::Vector3d(std::cos(e) * std::cos(yaw), std::cos(e) * std::sin(yaw), -std::sin(e));
  const double l1 = cell.arm.upper_arm_m;
  const double l2 = cell.arm.forearm_m;
  const double r = flange.head<2>().norm();
  const double elbow = std::acos((r * r - l1 * l1 - l2 * l2) / (2 * l1 * l2));
  const double j1 =
      std::atan2(flange.y(), flange.x()) - std::atan2(l2 * std::sin(elbow), l1 + l2 * std::cos(elbow));
  return {j1, elbow, flange.z(), yaw - j1 - elbow, tilt, rotation};
}

Emission emission_at(const CellDescription& cell, const Eigen::Vector3d& p_O, double yaw, double tilt = 0,
                     double rotation = 0) {
  Emission emission;
  emission.joints = joints_for(cell, p_O, yaw, tilt, rotation);
  emission.length_s = emission.commanded_s = .005;
  emission.power_w = full_energy_j(cell, kCellPitch) / .005;
  return emission;
}

double total_energy(const Film& film, double step_m) {
  double energy = 0;
  visit_surface(film.mesh(), step_m, [&](const SurfacePoint& point, double area_m2) {
    energy += film.dose_j_m2(point) * area_m2;
  });
  return energy;
}

TEST(Film, DoseOnAPlaneSumsToTheEnergyOfTheEmissions) {
  const CellDescription cell = handmade_cell();
  const TexturedMesh mesh = square(.02);
  Film film(mesh, cell, kCellPitch);
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> place(-.008, .008);
  std::vector<Emission> emissions;
  double energy = 0;
  for (int i = 0; i < 300; ++i) {
    emissions.push_back(emission_at(cell, {place(random), place(random), 0}, .2));
    energy += emissions.back().power_w * emissions.back().length_s;
  }
  film.expose(emissions);
  EXPECT_NEAR(total_energy(film, kCellPitch / 4), energy, .01 * energy);
}

TEST(Film, AnObliqueSpotKeepsItsEnergyAndGrowsLonger) {
  const TexturedMesh mesh = square(.01);
  CellDescription cell = handmade_cell();
  double width_at_vertical = 0;
  for (const double incidence : {0., 20., 45.}) {
    cell.arm.beam_depression = (90 - incidence) * kDegree;
    Film film(mesh, cell, kCellPitch);
    const Emission emission = emission_at(cell, Eigen::Vector3d::Zero(), 0);
    const Hit hit = film.expose(std::span(&emission, 1)).front();
    EXPECT_NEAR(hit.incidence, incidence * kDegree, 1e-6);
    const double energy = emission.power_w * emission.length_s;
    EXPECT_NEAR(total_energy(film, kCellPitch / 8), energy, .01 * energy) << incidence;

    // Variances, less what interpolating linearly between nodes h apart adds: h^2 / 6.
    Eigen::Vector2d spread = Eigen::Vector2d::Constant(-std::pow(kCellPitch / 2, 2) / 6);
    visit_surface(mesh, kCellPitch / 8, [&](const SurfacePoint& point, double area_m2) {
      spread += position(mesh, point).head<2>().cwiseAbs2() * film.dose_j_m2(point) * area_m2 / energy;
    });
    if (incidence == 0) width_at_vertical = spread.y();
    EXPECT_NEAR(spread.y(), width_at_vertical, .02 * width_at_vertical);
    EXPECT_NEAR(std::sqrt(spread.x() / spread.y()), 1 / std::cos(incidence * kDegree), .02) << incidence;
  }
}

TEST(Film, TheSpotIsTheGaussianOfTheCell) {
  const CellDescription cell = [] {
    CellDescription c = handmade_cell();
    c.arm.beam_depression = 90 * kDegree;
    return c;
  }();
  const TexturedMesh mesh = square(.01);
  Film film(mesh, cell, kCellPitch);
  const Emission emission = emission_at(cell, Eigen::Vector3d(kCellPitch / 3, 0, 0), 0);
  film.expose(std::span(&emission, 1));
  const double w = spot_diameter_m(cell, kCellPitch) / 2;
  const double peak = 2 * emission.power_w * emission.length_s / (std::numbers::pi * w * w);
  std::vector<FilmPoint> points;
  film.points_near({0, {.5, 0, .5}}, .003, points);
  double whole_m2 = 0;  // border nodes stand for less, and their piece's middle is not where they are
  for (const FilmPoint& point : points) whole_m2 = std::max(whole_m2, point.area_m2);
  int lit = 0;
  for (const FilmPoint& point : points) {
    if (point.area_m2 < .999 * whole_m2) continue;
    const double r = (point.position_O - Eigen::Vector3d(kCellPitch / 3, 0, 0)).norm();
    const double expected = r < kSpotCutRadii * w ? peak * std::exp(-2 * r * r / (w * w)) : 0;
    if (std::abs(r - kSpotCutRadii * w) < 1e-6) continue;
    EXPECT_NEAR(point.dose_j_m2, expected, .005 * peak);
    lit += expected > 0;
  }
  EXPECT_GT(lit, 10);
}

TEST(Film, BeamsLandWhereTheClosedFormSays) {
  const CellDescription cell = handmade_cell();
  const TexturedMesh mesh = square(.04);
  Film film(mesh, cell, kCellPitch);
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> place(-.015, .015), yaw(-.4, .4), tilt(-.3, .8), rotation(-3, 3);
  std::vector<Emission> emissions;
  std::vector<Eigen::Vector3d> wanted;
  for (int i = 0; i < 2000; ++i) {
    wanted.emplace_back(place(random), place(random), 0);
    emissions.push_back(emission_at(cell, wanted.back(), yaw(random), tilt(random), rotation(random)));
  }
  const std::vector<Hit> hits = film.expose(emissions);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    ASSERT_TRUE(hits[i].is_hit);
    EXPECT_FALSE(hits[i].is_shadowed);
    EXPECT_LT((hits[i].position_O - wanted[i]).norm(), 1e-9);
    EXPECT_LT((position(mesh, hits[i].point) - wanted[i]).norm(), 1e-9);
    EXPECT_LT(std::abs(hits[i].defocus_m), 1e-9);
  }
}

TEST(Film, BeamsMeetASphereWhereTheRayDoes) {
  const CellDescription cell = handmade_cell();
  const double radius = .02;
  const TexturedMesh mesh = test::ball(radius, 400);
  Film film(mesh, cell, kCellPitch);
  const Eigen::Vector3d middle(0, 0, radius);
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> offset(-.008, .008), yaw(-.3, .3), rotation(-3, 3);
  int checked = 0;
  for (int i = 0; i < 300; ++i) {
    const Emission emission =
        emission_at(cell, middle + Eigen::Vector3d(offset(random), offset(random), offset(random)),
                    yaw(random), .3, rotation(random));
    const Beam beam = beam_from_joints(cell, emission.joints);
    const Eigen::Vector3d from_middle = beam.focus_O - middle;
    const double b = from_middle.dot(beam.direction_O);
    const double s = -b - std::sqrt(b * b - from_middle.squaredNorm() + radius * radius);
    const Hit hit = film.expose(std::span(&emission, 1)).front();
    ASSERT_TRUE(hit.is_hit);
    // The facets of a sphere of 400 rings lie at most 2e-6 m inside it.
    EXPECT_LT((hit.position_O - (beam.focus_O + s * beam.direction_O)).norm(), 3e-6);
    EXPECT_TRUE(hit.is_shadowed);  // the focus is inside
    EXPECT_NEAR(hit.defocus_m, s, 3e-6);
    ++checked;
  }
  EXPECT_EQ(checked, 300);
}

TEST(Film, NoDoseLeaksThroughAWallOfTwoMillimeters) {
  CellDescription cell = handmade_cell();
  cell.arm.beam_depression = 90 * kDegree;
  TexturedMesh mesh = square(.01, 0);  // triangles 0 and 1: the lit face
  const double r = .005;
  const double below = -.002;
  test::add_quad(mesh, {Eigen::Vector3d{-r, r, below},
                        {r, r, below},
                        {r, -r, below},
                        {-r, -r, below}});  // the wall's other face
  test::add_quad(mesh, {Eigen::Vector3d{-r, -r, below},
                        {r, -r, below},
                        {r, r, below},
                        {-r, r, below}});  // a sheet behind, facing the light
  Film film(mesh, cell, kCellPitch);
  const Emission emission = emission_at(cell, Eigen::Vector3d::Zero(), 0);
  film.expose(std::span(&emission, 1));
  double lit = 0;
  visit_surface(mesh, kCellPitch / 4, [&](const SurfacePoint& point, double) {
    if (point.triangle < 2)
      lit = std::max(lit, film.dose_j_m2(point));
    else
      EXPECT_EQ(film.dose_j_m2(point), 0);
  });
  EXPECT_GT(lit, cell.paint.dose_full_j_m2);
}

TEST(Film, AnObstacleTakesTheLightAndIsReportedAsShadow) {
  CellDescription cell = handmade_cell();
  cell.arm.beam_depression = 90 * kDegree;
  TexturedMesh mesh = square(.01, 0);
  const double r = .002;
  const double above = .01;
  test::add_quad(mesh, {Eigen::Vector3d{-r, -r, above}, {r, -r, above}, {r, r, above}, {-r, r, above}});
  Film film(mesh, cell, kCellPitch);
  const Emission emission = emission_at(cell, Eigen::Vector3d::Zero(), 0);
  const Hit hit = film.expose(std::span(&emission, 1)).front();
  EXPECT_TRUE(hit.is_shadowed);
  EXPECT_GE(hit.point.triangle, 2u);
  EXPECT_NEAR(hit.defocus_m, -above, 1e-9);
  const double energy = emission.power_w * emission.length_s;
  EXPECT_NEAR(total_energy(film, kCellPitch / 8), energy, .01 * energy);
}

TEST(Film, DefocusSpreadsTheSpotAndKeepsItsEnergy) {
  CellDescription cell = handmade_cell();
  cell.arm.beam_depression = 90 * kDegree;
  const TexturedMesh mesh = square(.02);
  double sharp_peak = 0;
  for (const double defocus : {0., .03}) {
    Film film(mesh, cell, kCellPitch);
    const Emission emission = emission_at(cell, {0, 0, defocus}, 0);
    const Hit hit = film.expose(std::span(&emission, 1)).front();
    EXPECT_NEAR(hit.defocus_m, defocus, 1e-9);
    const double energy = emission.power_w * emission.length_s;
    EXPECT_NEAR(total_energy(film, kCellPitch / 8), energy, .01 * energy);
    const double peak = film.dose_j_m2({0, {.5, 0, .5}});
    if (defocus == 0)
      sharp_peak = peak;
    else
      EXPECT_LT(peak, .6 * sharp_peak);
  }
}

TEST(Film, ABeamPastTheObjectLandsNowhere) {
  const CellDescription cell = handmade_cell();
  const TexturedMesh mesh = square(.01);
  Film film(mesh, cell, kCellPitch);
  const Emission emission = emission_at(cell, {.05, .05, 0}, 0);
  EXPECT_FALSE(film.expose(std::span(&emission, 1)).front().is_hit);
  EXPECT_EQ(total_energy(film, kCellPitch), 0);
}

TEST(Film, NeedlesAndSliversCarryTheSameDoseAsAPlainSquare) {
  const CellDescription cell = handmade_cell();
  // The same square as a fan of 400 needles from one corner.
  TexturedMesh needles;
  const double r = .005;
  const int n = 200;
  for (int i = 0; i < n; ++i) {
    const double a = -r + 2 * r * i / n;
    const double b = -r + 2 * r * (i + 1) / n;
    for (const auto& [p, q] : {std::pair{Eigen::Vector3d(r, a, 0), Eigen::Vector3d(r, b, 0)},
                               std::pair{Eigen::Vector3d(-a, r, 0), Eigen::Vector3d(-b, r, 0)}}) {
      const auto first = static_cast<std::uint32_t>(needles.vertices.size());
      for (const Eigen::Vector3d& vertex : {Eigen::Vector3d(-r, -r, 0), p, q})
        needles.vertices.push_back(vertex);
      needles.triangles.push_back({first, first + 1, first + 2});
    }
  }
  const TexturedMesh plain = square(2 * r);
  Film film(plain, cell, kCellPitch), needle_film(needles, cell, kCellPitch);
  std::vector<Emission> emissions;
  double energy = 0;
  for (int i = 0; i < 400; ++i) {
    emissions.push_back(emission_at(cell, {-.004 + .0004 * (i % 20), -.004 + .0004 * (i / 20), 0}, .1));
    energy += emissions.back().power_w * emissions.back().length_s;
  }
  film.expose(emissions);
  needle_film.expose(emissions);
  EXPECT_NEAR(total_energy(film, kCellPitch / 4), energy, .01 * energy);
  EXPECT_NEAR(total_energy(needle_film, kCellPitch / 8), energy, .01 * energy);
}

TEST(Film, FilmPointsStandForTheAreaOfTheSurface) {
  const CellDescription cell = handmade_cell();
  const TexturedMesh mesh = square(.02);
  const Film film(mesh, cell, kCellPitch);
  std::vector<FilmPoint> points;
  film.points_near({0, {.5, 0, .5}}, .05, points);
  double area = 0;
  for (const FilmPoint& point : points) area += point.area_m2;
  EXPECT_NEAR(area, mesh.area_m2(), 1e-6 * area);
  const double radius = 12 * kCellPitch;
  film.points_near({0, {.5, 0, .5}}, radius, points);
  area = 0;
  for (const FilmPoint& point : points) {
    area += point.area_m2;
    EXPECT_LE((point.position_O - Eigen::Vector3d::Zero()).norm(), radius + kCellPitch / 2);
    EXPECT_LT((point.position_O - position(mesh, point.point)).norm(), 1e-12);
  }
  EXPECT_NEAR(area, std::numbers::pi * radius * radius, .02 * area);
}

TEST(Film, TheSameBytesForAnyNumberOfThreads) {
  const CellDescription cell = handmade_cell();
  const TexturedMesh mesh = test::ball(.015, 30);
  std::vector<Emission> emissions;
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> offset(-.01, .01);
  for (int i = 0; i < 5000; ++i)
    emissions.push_back(emission_at(cell, {offset(random), offset(random), .015 + offset(random)}, 0, .5,
                                    300 * offset(random)));
  std::vector<double> first;
  for (const int threads : {1, 2, 3, 8}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    Film film(mesh, cell, kCellPitch);
    film.expose(emissions);
    std::vector<double> doses;
    visit_surface(mesh, kCellPitch,
                  [&](const SurfacePoint& point, double) { doses.push_back(film.dose_j_m2(point)); });
    if (first.empty()) first = doses;
    EXPECT_EQ(first, doses) << threads << " threads";
  }
}

}  // namespace
}  // namespace hilbrush
