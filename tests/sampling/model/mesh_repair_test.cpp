#include "sampling/model/mesh_repair.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "sampling/base/input_error.h"
#include "sampling/disk/components.h"
#include "tests/support/meshes.h"

namespace hilbrush {
namespace {

std::size_t count_of(const RepairedMesh& repaired, const std::string& what) {
  for (const Repair& repair : repaired.repairs)
    if (repair.what == what) return repair.count;
  return 0;
}

double volume(const TexturedMesh& mesh) {
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t)
    sum += mesh.area_vector(t).dot(mesh.corner(t, 0)) / 3;
  return sum;
}

/// Every edge has one or two triangles, every vertex one fan.
void expect_manifold(const TexturedMesh& mesh) {
  for (const EdgeGroup& group : edge_table(mesh.triangles).groups) EXPECT_LE(group.end - group.begin, 2u);
  const Neighbors neighbors = find_neighbors(mesh.triangles);
  const Fans fans = find_fans(neighbors);
  EXPECT_EQ(fans.count, mesh.vertices.size());
}

void turn(TexturedMesh& mesh, std::size_t t) {
  std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
  std::swap(mesh.corner_uv[t][1], mesh.corner_uv[t][2]);
  std::swap(mesh.corner_luminance[t][1], mesh.corner_luminance[t][2]);
}

TEST(MeshRepair, LeavesAGoodMeshAlone) {
  const TexturedMesh mesh = test::sphere(.02);
  const RepairedMesh repaired = repair_mesh(mesh);
  EXPECT_TRUE(repaired.repairs.empty());
  EXPECT_EQ(repaired.mesh.triangles, mesh.triangles);
  EXPECT_EQ(repaired.mesh.vertices.size(), mesh.vertices.size());
}

TEST(MeshRepair, MakesEveryAwkwardMeshManifold) {
  for (const auto& [name, mesh] : test::awkward_meshes()) {
    SCOPED_TRACE(name);
    const RepairedMesh repaired = repair_mesh(mesh);
    expect_manifold(repaired.mesh);
    EXPECT_NEAR(repaired.mesh.area_m2(), mesh.area_m2(), 1e-9 * mesh.area_m2());
  }
}

TEST(MeshRepair, WeldsASoupAndZerosOfBothSigns) {
  TexturedMesh mesh = test::soup(test::cube());
  mesh.vertices[0] = Eigen::Vector3d(-0., -0., -0.);
  const RepairedMesh repaired = repair_mesh(mesh);
  EXPECT_EQ(repaired.mesh.vertices.size(), 8u);
  EXPECT_EQ(count_of(repaired, "vertices welded"), 36u - 8u);
}

TEST(MeshRepair, DropsDegenerateDuplicateAndUnusableTriangles) {
  TexturedMesh mesh = test::cube();
  const auto bad = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.emplace_back(std::nan(""), 0, 0);
  mesh.triangles.push_back({0, 1, bad});        // not a number
  mesh.triangles.push_back({0, 1, 4'000'000});  // no such vertex
  mesh.triangles.push_back({0, 1, 1});          // an edge
  mesh.triangles.push_back(mesh.triangles[0]);
  mesh.triangles.push_back({mesh.triangles[1][1], mesh.triangles[1][0], mesh.triangles[1][2]});
  const RepairedMesh repaired = repair_mesh(test::finish(std::move(mesh)));
  EXPECT_EQ(count_of(repaired, "triangles without usable corners dropped"), 2u);
  EXPECT_EQ(count_of(repaired, "degenerate triangles dropped"), 1u);
  EXPECT_EQ(count_of(repaired, "duplicate triangles dropped"), 2u);
  EXPECT_EQ(repaired.mesh.triangle_count(), 12u);
}

TEST(MeshRepair, OrientsClosedPartsOutwardsAndOpenOnesByMajority) {
  TexturedMesh inside_out = test::cube();
  for (std::size_t t = 0; t < inside_out.triangle_count(); ++t)
    if (t != 5) turn(inside_out, t);
  RepairedMesh repaired = repair_mesh(inside_out);
  EXPECT_NEAR(volume(repaired.mesh), std::pow(.04, 3), 1e-12);

  TexturedMesh open = test::rectangle(.05, .05, 4, 4);
  for (const std::size_t t : {std::size_t{3}, std::size_t{8}, std::size_t{20}}) turn(open, t);
  repaired = repair_mesh(open);
  EXPECT_EQ(count_of(repaired, "triangles turned over"), 3u);
  for (std::size_t t = 0; t < repaired.mesh.triangle_count(); ++t) {
    EXPECT_GT(repaired.mesh.area_vector(t).z(), 0);
    // The corners' uv went with them: here uv is the position itself.
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR((repaired.mesh.corner_uv[t][static_cast<std::size_t>(c)] * .05 -
                   repaired.mesh.corner(t, c).head<2>())
                      .norm(),
                  0, 1e-12);
  }
}

/// A sphere without the triangles whose middle `is_hole` says is in a hole, inside out.
TexturedMesh inside_out_sphere(const std::function<bool(const Eigen::Vector3d&)>& is_hole) {
  TexturedMesh mesh = test::sphere(.02);
  std::vector<Triangle> kept;
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
    const Eigen::Vector3d middle = (mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3;
    const auto& [a, b, c] = mesh.triangles[t];
    if (!is_hole(middle / .02)) kept.push_back({a, c, b});
  }
  mesh.triangles = std::move(kept);
  mesh.corner_uv.clear();
  mesh.corner_luminance.clear();
  mesh.material_index.clear();
  return test::finish(std::move(mesh));
}

constexpr const char* kTurned = "triangles of almost closed parts turned over, which were inside out";

TEST(MeshRepair, TurnsAlmostClosedPartsOutwards) {
  // Three holes, and the part far from the origin: its volume must not depend on where it stands.
  TexturedMesh scan = inside_out_sphere([](const Eigen::Vector3d& p) {
    return p.z() < -.9 || p.x() > .95 || (p - Eigen::Vector3d(0, .8, .6)).norm() < .2;
  });
  for (Eigen::Vector3d& p : scan.vertices) p += Eigen::Vector3d(10, -20, 30);
  const std::size_t count = scan.triangle_count();
  const RepairedMesh repaired = repair_mesh(std::move(scan));
  EXPECT_EQ(count_of(repaired, kTurned), count);
  for (std::size_t t = 0; t < count; ++t)
    EXPECT_GT(repaired.mesh.area_vector(t).dot(repaired.mesh.corner(t, 0) - Eigen::Vector3d(10, -20, 30)), 0);
  const RepairedMesh again = repair_mesh(repaired.mesh);
  EXPECT_EQ(count_of(again, kTurned), 0u) << "what shows its outside stays";
}

TEST(MeshRepair, LeavesWhatMayShowItsInsideOnPurpose) {
  const auto is_turned = [](TexturedMesh mesh) {
    return count_of(repair_mesh(std::move(mesh)), kTurned) > 0;
  };
  EXPECT_FALSE(is_turned(inside_out_sphere([](const Eigen::Vector3d& p) { return p.z() > 0; }))) << "a bowl";
  EXPECT_FALSE(is_turned(inside_out_sphere([](const Eigen::Vector3d& p) { return p.z() > .5; })))
      << "a deep bowl";
  EXPECT_FALSE(is_turned(test::rectangle(.05, .05, 4, 4)));
  EXPECT_FALSE(is_turned(test::folded_sheet(.05, 1, 4, 4)));
}

TEST(MeshRepair, WeldsVerticesThatDifferByRounding) {
  TexturedMesh mesh = test::soup(test::sphere(.02));
  std::uint64_t state = 1;
  for (Eigen::Vector3d& p : mesh.vertices)
    for (int axis = 0; axis < 3; ++axis) {
      state = state * 6364136223846793005u + 1442695040888963407u;
      p[axis] += 1e-12 * (static_cast<double>(state >> 40) / (1 << 24) - .5);
    }
  const RepairedMesh repaired = repair_mesh(std::move(mesh));
  EXPECT_EQ(repaired.mesh.vertices.size(), test::sphere(.02).vertices.size());
  EXPECT_EQ(find_components(repaired.mesh, find_neighbors(repaired.mesh.triangles)).size(), 1u);
  // The smallest detail that a file in single precision can hold is kept: a step of 1e-7 of the size.
  TexturedMesh step = test::rectangle(.05, .05, 4, 4);
  const std::size_t vertices = step.vertices.size();
  step.vertices.emplace_back(.05, .05, 5e-9);
  step.triangles.push_back({static_cast<std::uint32_t>(vertices) - 1,
                            static_cast<std::uint32_t>(vertices) - 2, static_cast<std::uint32_t>(vertices)});
  EXPECT_EQ(repair_mesh(test::finish(step)).mesh.vertices.size(), vertices + 1);
}

TEST(MeshRepair, SeparatesSolidsThatOnlyTouch) {
  const auto meshes = test::awkward_meshes();
  for (const char* name : {"cubes that share an edge", "cubes that share a corner"}) {
    const RepairedMesh repaired = repair_mesh(meshes.at(name));
    const auto components = find_components(repaired.mesh, find_neighbors(repaired.mesh.triangles));
    ASSERT_EQ(components.size(), 2u) << name;
    for (const Component& component : components) {
      EXPECT_EQ(component.genus, 0);
      EXPECT_EQ(component.boundary_loops, 0);
    }
  }
}

TEST(MeshRepair, CutsAMoebiusStrip) {
  const RepairedMesh repaired = repair_mesh(test::moebius_strip());
  EXPECT_GT(count_of(repaired, "edges cut where the surface has one side only"), 0u);
}

TEST(MeshRepair, RefusesWhatHasNoArea) {
  TexturedMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  mesh.triangles = {{0, 1, 2}};
  EXPECT_THROW(repair_mesh(test::finish(mesh)), InputError);
}

}  // namespace
}  // namespace hilbrush
