#pragma once
#include <algorithm>
#include <utility>
#include <vector>

#include "sampling/model/edges.h"
#include "sampling/model/renumber.h"
#include "sampling/model/textured_mesh.h"

/// Larger meshes from small ones, for benchmarks and tests of size.
namespace hilbrush::test {

/// Puts a vertex in the middle of an edge: each triangle at it becomes two.
inline void halve_side(TexturedMesh& mesh, TriangleSide at, std::uint32_t middle) {
  const std::size_t t = at.triangle;
  const std::size_t i = at.side;
  const std::size_t j = (i + 1) % 3;
  mesh.triangles.push_back(mesh.triangles[t]);
  mesh.corner_uv.push_back(mesh.corner_uv[t]);
  mesh.corner_luminance.push_back(mesh.corner_luminance[t]);
  mesh.material_index.push_back(mesh.material_index[t]);
  const std::size_t added = mesh.triangles.size() - 1;
  const Eigen::Vector2d uv = .5 * (mesh.corner_uv[t][i] + mesh.corner_uv[t][j]);
  const float luminance = .5f * (mesh.corner_luminance[t][i] + mesh.corner_luminance[t][j]);
  mesh.triangles[t][j] = mesh.triangles[added][i] = middle;
  mesh.corner_uv[t][j] = mesh.corner_uv[added][i] = uv;
  mesh.corner_luminance[t][j] = mesh.corner_luminance[added][i] = luminance;
}

/// Halves the longest edges, round by round, until there are `triangle_count` triangles (or one more); the
/// surface and its colors stay as they are. Edges are those between vertex indices: weld the mesh before.
/// Numbered as a mesh of that size from a file would be.
inline TexturedMesh subdivided(TexturedMesh mesh, std::size_t triangle_count) {
  while (mesh.triangles.size() < triangle_count) {
    const EdgeTable edges = edge_table(mesh.triangles);
    const auto length2 = [&](const EdgeGroup& e) {
      return (mesh.vertices[e.to] - mesh.vertices[e.from]).squaredNorm();
    };
    std::vector<std::pair<double, std::uint32_t>> order;
    for (std::uint32_t i = 0; i < edges.groups.size(); ++i) order.emplace_back(-length2(edges.groups[i]), i);
    std::sort(order.begin(), order.end());
    // A triangle is halved once a round, and nothing shorter than half the longest edge is touched.
    std::vector<char> is_halved(mesh.triangles.size(), 0);
    for (const auto& [negative, index] : order) {
      if (mesh.triangles.size() >= triangle_count || negative > .25 * order.front().first) break;
      const EdgeGroup& edge = edges.groups[index];
      bool is_free = true;
      for (std::uint32_t i = edge.begin; i < edge.end; ++i)
        is_free = is_free && !is_halved[edges.sides[i].triangle];
      if (!is_free) continue;
      const auto middle = static_cast<std::uint32_t>(mesh.vertices.size());
      mesh.vertices.push_back(.5 * (mesh.vertices[edge.from] + mesh.vertices[edge.to]));
      for (std::uint32_t i = edge.begin; i < edge.end; ++i) {
        is_halved[edges.sides[i].triangle] = 1;
        halve_side(mesh, edges.sides[i], middle);
      }
    }
  }
  renumber_along_surface(mesh);
  return mesh;
}

}  // namespace hilbrush::test
