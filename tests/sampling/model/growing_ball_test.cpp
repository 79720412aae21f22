#include "sampling/model/growing_ball.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "sampling/model/nearest_in_triangle.h"
#include "tests/support/meshes.h"

namespace hilbrush {
namespace {

using Eigen::Vector3d;

constexpr double kFarAway = std::numeric_limits<double>::infinity();

double distance_to(const TexturedMesh& mesh, std::uint32_t t, const Vector3d& point) {
  const auto b = nearest_in_triangle(point, mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2));
  return (position(mesh, {t, b}) - point).norm();
}

TEST(GrowingBall, OnAPlateTrianglesAreAsFarAsTheyLook) {
  const TexturedMesh mesh = test::rectangle(.05, .03, 11, 7);
  const Neighbors neighbors = find_neighbors(mesh.triangles);
  GrowingBall ball(mesh, neighbors);
  for (const std::uint32_t start : {0u, 40u, 77u}) {
    const Vector3d center = position(mesh, {start, {.3, .3, .4}});
    ball.begin(center, start);
    for (std::uint32_t t = 0; t < mesh.triangle_count(); ++t)
      EXPECT_NEAR(std::sqrt(ball.entry2(t, kFarAway)), distance_to(mesh, t, center), 1e-12)
          << start << " to " << t;
  }
}

TEST(GrowingBall, TheOtherSideOfAFoldIsAsFarAsTheFold) {
  const double side = .04;
  const TexturedMesh mesh = test::folded_sheet(side, .1, 8, 8);
  const Neighbors neighbors = find_neighbors(mesh.triangles);
  GrowingBall ball(mesh, neighbors);
  // The fourth row from the fold, in the middle of the sheet; straight up is the other half, 2 mm away.
  for (std::uint32_t start = 0; start < mesh.triangle_count(); ++start) {
    const Vector3d center = position(mesh, {start, {.3, .3, .4}});
    if (center.z() > 0 || std::abs(center.y() - side / 2) > .1 * side ||
        std::abs(center.x() - .4 * side) > .1 * side)
      continue;
    ball.begin(center, start);
    for (std::uint32_t t = 0; t < mesh.triangle_count(); ++t) {
      if (position(mesh, {t, {.3, .3, .4}}).z() == 0) continue;
      EXPECT_GE(std::sqrt(ball.entry2(t, kFarAway)), center.x() * (1 - 1e-12));
      if (distance_to(mesh, t, center) < .9 * center.x()) {
        EXPECT_LT(std::sqrt(ball.entry2(t, kFarAway)), 1.1 * center.x());
      }
    }
  }
}

TEST(GrowingBall, EndsAtItsLimitAndAtTheComponent) {
  const TexturedMesh one = test::rectangle(.05, .05, 10, 10);
  const TexturedMesh mesh = test::both(one, one, {0, 0, .001});
  const Neighbors neighbors = find_neighbors(mesh.triangles);
  const auto last = static_cast<std::uint32_t>(one.triangle_count() - 1);
  const std::uint32_t above = last + 1;
  GrowingBall ball(mesh, neighbors);
  ball.begin(mesh.corner(0, 0), 0);
  EXPECT_EQ(ball.entry2(0, 1e-9), 0);
  EXPECT_EQ(ball.entry2(last, .01 * .01), kFarAway);
  EXPECT_NEAR(ball.entry2(last, 1), std::pow(distance_to(mesh, last, mesh.corner(0, 0)), 2), 1e-15)
      << "it goes on from where it ended";
  EXPECT_EQ(ball.entry2(above, 1), kFarAway);
  ball.begin(mesh.corner(above, 0), above);
  EXPECT_EQ(ball.entry2(above, 1), 0);
  EXPECT_EQ(ball.entry2(0, 1), kFarAway) << "nothing is left of the ball before";
}

}  // namespace
}  // namespace hilbrush
