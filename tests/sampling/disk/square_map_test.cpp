#include "sampling/disk/square_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "sampling/base/cross.h"
#include "sampling/disk/orientation.h"
#include "sampling/model/mesh_repair.h"
#include "tests/support/meshes.h"

namespace hilbrush {
namespace {

TEST(Orientation, IsExactWhereRoundingIsNot) {
  // Points within a few last digits of one line (Kettner et al. 2004): the plain formula gets these wrong.
  const Eigen::Vector2d b(12, 12), c(24, 24);
  const double step = std::ldexp(1, -53);
  int differing = 0;
  for (int i = 0; i < 32; ++i)
    for (int j = 0; j < 32; ++j) {
      const Eigen::Vector2d a(.5 + i * step, .5 + j * step);
      const int exact = (i > j) - (i < j);  // below the diagonal
      EXPECT_EQ(orientation(a, b, c), -exact == 0 ? 0 : (exact > 0 ? 1 : -1) * orientation({1, 0}, b, c));
      const double plain = (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
      differing += (plain > 0) != (orientation(a, b, c) > 0);
    }
  EXPECT_GT(differing, 0) << "the test would not notice a plain formula";
  EXPECT_EQ(orientation({0, 0}, {1, 0}, {0, 1}), 1);
  EXPECT_EQ(orientation({0, 0}, {0, 1}, {1, 0}), -1);
}

TEST(SquareMap, HasNoFlippedFaceAndFillsTheSquare) {
  for (const auto& [name, awkward] : test::awkward_meshes()) {
    SCOPED_TRACE(name);
    const TexturedMesh mesh = repair_mesh(awkward).mesh;
    const Neighbors neighbors = find_neighbors(mesh.triangles);
    for (const Component& component : find_components(mesh, neighbors)) {
      auto cut = cut_to_disk(mesh, neighbors, component);
      ASSERT_TRUE(cut) << cut.reason();
      const auto map = map_to_square(*cut);
      ASSERT_TRUE(map);
      EXPECT_EQ(count_flipped(cut->disk, map->places), 0u);
      double area = 0, surface = 0;
      for (std::size_t f = 0; f < cut->disk.faces().size(); ++f) {
        const Triangle& face = cut->disk.faces()[f];
        const Eigen::Vector2d u = map->places[face[1]] - map->places[face[0]],
                              v = map->places[face[2]] - map->places[face[0]];
        area += .5 * cross(u, v);
        const FaceSource& source = cut->disk.sources()[f];
        if (source.triangle == kNoTriangle) continue;
        const Eigen::Vector2d p = source.corners[1] - source.corners[0],
                              q = source.corners[2] - source.corners[0];
        surface += cross(p, q) * mesh.area_vector(source.triangle).norm();
      }
      EXPECT_NEAR(area, map->square_count, 1e-9 * map->square_count);
      EXPECT_NEAR(surface / component.area_m2, 1, 1e-9);
    }
  }
}

TEST(SquareMap, KnowsHandlesAndBoundaries) {
  const auto shape = [](const TexturedMesh& mesh) {
    const auto components = find_components(mesh, find_neighbors(mesh.triangles));
    EXPECT_EQ(components.size(), 1u);
    return std::pair(components[0].genus, components[0].boundary_loops);
  };
  EXPECT_EQ(shape(test::sphere(.02)), std::pair(0, 0));
  EXPECT_EQ(shape(test::torus()), std::pair(1, 0));
  EXPECT_EQ(shape(test::even_cylinder()), std::pair(0, 2));
  EXPECT_EQ(shape(test::plate_with_holes()), std::pair(0, 4));
}

TEST(SquareMap, GivesAStripItsSquaresInARow) {
  const TexturedMesh mesh = test::rectangle(.05, .005, 40, 4);
  const Neighbors neighbors = find_neighbors(mesh.triangles);
  auto cut = cut_to_disk(mesh, neighbors, find_components(mesh, neighbors)[0]);
  ASSERT_TRUE(cut) << cut.reason();
  const auto map = map_to_square(*cut);
  ASSERT_TRUE(map);
  EXPECT_EQ(map->square_count, 10);
}

TEST(SquareMap, IsAllButConformalOnASlitBlob) {
  // Whatever its length: the boundary of a sphere's slit is placed as it should be, and where that does not
  // fit, corners are moved until the map is a whole number of squares.
  for (const double length : {1., 1.3, 1.7, 2.2, 3.}) {
    TexturedMesh mesh = test::sphere(.02, 96, 64);
    for (auto& vertex : mesh.vertices) vertex.z() *= length;
    const Neighbors neighbors = find_neighbors(mesh.triangles);
    auto cut = cut_to_disk(mesh, neighbors, find_components(mesh, neighbors)[0]);
    ASSERT_TRUE(cut) << cut.reason();
    const auto map = map_to_square(*cut);
    ASSERT_TRUE(map);
    EXPECT_LE(map->lengthening, 1.006) << length << ", squares " << map->square_count;
  }
}

}  // namespace
}  // namespace hilbrush
