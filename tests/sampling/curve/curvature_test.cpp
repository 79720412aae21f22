#include "sampling/curve/curvature.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "sampling/tone/tone_field.h"
#include "tests/support/meshes.h"

namespace hilbrush {
namespace {

using test::kPi;

/// visit(mean, gaussian, place) at every corner.
template <class Visit>
void at_corners(const TexturedMesh& mesh, Visit visit) {
  const Curvature curvature = measure_curvature(mesh);
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t)
    for (int c = 0; c < 3; ++c) {
      const auto corner = static_cast<std::size_t>(c);
      visit(curvature.mean[t][corner], curvature.gaussian[t][corner], mesh.corner(t, c));
    }
}

TEST(Curvature, OfASphere) {
  const double r = .025;
  for (const auto& mesh : {test::sphere(r, 96, 48), test::sphere(r, 48, 24), test::sphere(r, 300, 20)})
    at_corners(mesh, [&](double mean, double gaussian, const Eigen::Vector3d& p) {
      EXPECT_NEAR(mean * r, 1, .03) << p.transpose();
      EXPECT_NEAR(gaussian * r * r, 1, .03) << p.transpose();
    });
}

TEST(Curvature, OfARoughlyTriangulatedSphere) {
  // Vertices slid along the sphere, but for those near the poles, whose triangles would turn over.
  const double r = .025;
  TexturedMesh mesh = test::sphere(r, 96, 48);
  std::mt19937 random(11);
  std::normal_distribution<double> slide(0, .0002);
  for (auto& p : mesh.vertices)
    if (std::abs(p.z()) < .8 * r)
      p = r * (p + Eigen::Vector3d(slide(random), slide(random), slide(random))).normalized();
  double worst = 0, mean_error = 0, count = 0;
  at_corners(mesh, [&](double mean, double gaussian, const Eigen::Vector3d&) {
    worst = std::max(worst, std::abs(mean * r - 1));
    mean_error += std::abs(gaussian * r * r - 1);
    ++count;
  });
  EXPECT_LT(worst, .5) << "seed 11";
  EXPECT_LT(mean_error / count, .1) << "seed 11";
}

TEST(Curvature, OfATorus) {
  const double large = .03, small = .012;
  at_corners(test::torus(large, small, 144, 72), [&](double mean, double gaussian, const Eigen::Vector3d& p) {
    const double cosine = (std::hypot(p.x(), p.y()) - large) / small, away = large + small * cosine;
    EXPECT_NEAR(mean, (large + 2 * small * cosine) / (2 * small * away), .02 / small) << p.transpose();
    EXPECT_NEAR(gaussian, cosine / (small * away), .02 / (small * small)) << p.transpose();
  });
}

TEST(Curvature, OfCylindersUpToTheirRims) {
  for (const auto& mesh : {test::even_cylinder(), test::needle_cylinder()})
    at_corners(mesh, [&](double mean, double gaussian, const Eigen::Vector3d& p) {
      EXPECT_NEAR(mean * .02, .5, .005) << p.transpose();
      EXPECT_NEAR(gaussian * .02 * .02, 0, 1e-6) << p.transpose();
    });
}

TEST(Curvature, OfAPlaneIsNone) {
  at_corners(test::plate_with_holes(), [](double mean, double gaussian, const Eigen::Vector3d&) {
    EXPECT_NEAR(mean, 0, 1e-9);
    EXPECT_NEAR(gaussian, 0, 1e-6);
  });
}

/// Inside out, a sphere is concave; what bends is the same.
TEST(Curvature, SignFollowsTheOutside) {
  TexturedMesh mesh = test::sphere(.025);
  for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
  at_corners(mesh, [](double mean, double gaussian, const Eigen::Vector3d&) {
    EXPECT_LT(mean, 0);
    EXPECT_GT(gaussian, 0);
  });
}

TEST(Curvature, IsFiniteOnHostileMeshes) {
  for (const auto& [name, mesh] : test::awkward_meshes())
    at_corners(mesh, [&, &called = name](double mean, double gaussian, const Eigen::Vector3d&) {
      EXPECT_TRUE(std::isfinite(mean) && std::isfinite(gaussian)) << called;
    });
}

double tone_at(const TexturedMesh& mesh, std::uint32_t triangle) {
  return ToneField(mesh, {}).asked({triangle, Eigen::Vector3d::Constant(1. / 3)});
}

TEST(CurvatureDensity, IsProportional) {
  const double large = .03, small = .012;
  const TexturedMesh torus = test::torus(large, small, 144, 72);
  for (const DensitySource source : {DensitySource::kMeanCurvature, DensitySource::kGaussianCurvature}) {
    const TexturedMesh mesh = with_curvature_density(torus, source);
    const ToneField tone(mesh, {});
    double darkest = 0, ratio = 0;
    for (std::uint32_t t = 0; t < mesh.triangle_count(); ++t) {
      const SurfacePoint middle{t, Eigen::Vector3d::Constant(1. / 3)};
      const Eigen::Vector3d p = position(mesh, middle);
      const double cosine = (std::hypot(p.x(), p.y()) - large) / small, away = large + small * cosine;
      const double exact =
          std::abs(source == DensitySource::kMeanCurvature ? (large + 2 * small * cosine) / (2 * small * away)
                                                           : cosine / (small * away));
      const double asked = tone.asked(middle);
      darkest = std::max(darkest, asked);
      if (asked > .3 && asked < .9) {
        if (ratio == 0) ratio = asked / exact;
        EXPECT_NEAR(asked / exact, ratio, .08 * ratio) << p.transpose();
      }
    }
    EXPECT_EQ(darkest, 1);
  }
}

TEST(CurvatureDensity, FlatIsWhiteAndTextureIsKept) {
  const TexturedMesh plate = test::rectangle(.05, .05, 7, 7);
  EXPECT_EQ(tone_at(with_curvature_density(plate, DensitySource::kMeanCurvature), 5), 0);
  EXPECT_EQ(tone_at(with_curvature_density(plate, DensitySource::kGaussianCurvature), 5), 0);
  EXPECT_EQ(tone_at(with_curvature_density(plate, DensitySource::kTexture), 5), 1);
}

TEST(CurvatureDensity, PicturesMakeWay) {
  const TexturedMesh white = test::with_texture(test::sphere(.025), 2, 2, [](int, int) { return 1.; });
  EXPECT_EQ(tone_at(white, 100), 0);
  EXPECT_GT(tone_at(with_curvature_density(white, DensitySource::kMeanCurvature), 100), .9);
}

}  // namespace
}  // namespace hilbrush
