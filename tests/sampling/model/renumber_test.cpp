#include "sampling/model/renumber.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <tuple>

#include "sampling/disk/components.h"
#include "tests/support/meshes.h"

namespace hilbrush {
namespace {

/// Triangles in any order.
TexturedMesh shuffled(const TexturedMesh& mesh, unsigned seed) {
  std::vector<std::uint32_t> order(mesh.triangle_count());
  std::iota(order.begin(), order.end(), 0);
  std::shuffle(order.begin(), order.end(), std::mt19937(seed));
  TexturedMesh result = mesh;
  for (std::size_t t = 0; t < order.size(); ++t) {
    result.triangles[t] = mesh.triangles[order[t]];
    result.corner_uv[t] = mesh.corner_uv[order[t]];
    result.corner_luminance[t] = mesh.corner_luminance[order[t]];
    result.material_index[t] = mesh.material_index[order[t]];
  }
  return result;
}

/// All that is known of each triangle, whatever its number.
auto contents(const TexturedMesh& mesh) {
  using Corner = std::tuple<double, double, double, double, double, float>;
  std::vector<std::pair<std::array<Corner, 3>, std::uint32_t>> result;
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
    std::array<Corner, 3> corners;
    for (std::size_t c = 0; c < 3; ++c) {
      const Eigen::Vector3d p = mesh.corner(t, c);
      const Eigen::Vector2d uv = mesh.corner_uv[t][c];
      corners[c] = {p.x(), p.y(), p.z(), uv.x(), uv.y(), mesh.corner_luminance[t][c]};
    }
    result.emplace_back(corners, mesh.material_index[t]);
  }
  std::sort(result.begin(), result.end());
  return result;
}

/// Mean of how far apart the numbers of neighbors are.
double mean_gap(const TexturedMesh& mesh) {
  const Neighbors neighbors = find_neighbors(mesh.triangles);
  double sum = 0;
  double count = 0;
  for (std::uint32_t t = 0; t < neighbors.size(); ++t)
    for (const TriangleSide other : neighbors[t])
      if (other != kNoSide) {
        sum += std::abs(static_cast<double>(other.triangle) - t);
        ++count;
      }
  return sum / count;
}

TexturedMesh two_spheres() {
  TexturedMesh mesh = test::both(test::sphere(.02, 120, 60), test::sphere(.01, 60, 30));
  for (std::uint32_t t = 0; t < mesh.triangle_count(); ++t) {
    mesh.material_index[t] = t % 3;
    for (std::size_t c = 0; c < 3; ++c) {
      mesh.corner_uv[t][c] = {.1 * t, .01 * static_cast<double>(c)};
      mesh.corner_luminance[t][c] = static_cast<float>(t % 7) / 7 + .01f * static_cast<float>(c);
    }
  }
  return mesh;
}

TEST(RenumberAlongSurface, ItIsTheSameSurfaceAndNeighborsHaveNearNumbers) {
  const TexturedMesh mesh = shuffled(two_spheres(), 3);
  TexturedMesh renumbered = mesh;
  renumber_along_surface(renumbered);
  EXPECT_EQ(contents(renumbered), contents(mesh));
  EXPECT_EQ(renumbered.vertices.size(), mesh.vertices.size());
  EXPECT_GT(mean_gap(mesh), 4000);
  EXPECT_LT(mean_gap(renumbered), 400);
}

TEST(RenumberAlongSurface, PartsKeepTheirOrder) {
  for (const unsigned seed : {1u, 2u, 3u, 4u}) {
    const TexturedMesh mesh = shuffled(two_spheres(), seed);
    TexturedMesh renumbered = mesh;
    renumber_along_surface(renumbered);
    const auto before = find_components(mesh, find_neighbors(mesh.triangles));
    const auto after = find_components(renumbered, find_neighbors(renumbered.triangles));
    ASSERT_EQ(after.size(), before.size());
    for (std::size_t i = 0; i < after.size(); ++i)
      EXPECT_EQ(after[i].triangles.size(), before[i].triangles.size()) << "seed " << seed;
    // One after the other.
    EXPECT_EQ(after[0].triangles.back() + 1, after[1].triangles.front());
  }
}

TEST(RenumberAlongSurface, ASmallMeshStaysAsItIs) {
  const TexturedMesh mesh = shuffled(test::sphere(.02), 5);
  TexturedMesh renumbered = mesh;
  renumber_along_surface(renumbered);
  EXPECT_EQ(renumbered.triangles, mesh.triangles);
}

TEST(RenumberAlongSurface, AFlatMeshHasAnOrderToo) {
  const TexturedMesh mesh = shuffled(test::rectangle(.05, .05, 100, 100), 7);
  TexturedMesh renumbered = mesh;
  renumber_along_surface(renumbered);
  EXPECT_EQ(contents(renumbered), contents(mesh));
  EXPECT_LT(mean_gap(renumbered), .05 * mean_gap(mesh));
}

}  // namespace
}  // namespace hilbrush
