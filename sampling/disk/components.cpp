#include "sampling/disk/components.h"

#include <algorithm>
#include <utility>

namespace hilbrush {
namespace {

std::vector<std::uint32_t> collect(std::uint32_t seed, const Neighbors& neighbors,
                                   std::vector<char>& is_seen) {
  std::vector<std::uint32_t> triangles{seed};
  is_seen[seed] = 1;
  for (std::size_t i = 0; i < triangles.size(); ++i)
    for (const TriangleSide other : neighbors[triangles[i]])
      if (other != kNoSide && !is_seen[other.triangle]) {
        is_seen[other.triangle] = 1;
        triangles.push_back(other.triangle);
      }
  std::sort(triangles.begin(), triangles.end());
  return triangles;
}

/// Euler's formula: fans - edges + triangles = 2 - 2 genus - loops.
int genus_of(std::int64_t fans, std::int64_t edges, std::int64_t triangles, std::int64_t loops) {
  const std::int64_t twice = 2 - loops - (fans - edges + triangles);
  return twice >= 0 && twice % 2 == 0 ? static_cast<int>(twice / 2) : -1;
}

}  // namespace

Fans find_fans(const Neighbors& neighbors) {
  constexpr std::uint32_t kUnseen = ~std::uint32_t{0};
  Fans fans;
  fans.of_corners.assign(neighbors.size(), {kUnseen, kUnseen, kUnseen});
  for (std::uint32_t t = 0; t < neighbors.size(); ++t)
    for (std::uint8_t c = 0; c < 3; ++c) {
      if (fans.of_corners[t][c] != kUnseen) continue;
      const std::uint32_t fan = fans.count++;
      // Side c leaves the corner; the side before arrives. Go around one way until the fan closes or ends,
      // then the other way.
      TriangleSide at{t, c};
      do {
        fans.of_corners[at.triangle][at.side] = fan;
        const TriangleSide across = neighbors[at.triangle][(at.side + 2) % 3];
        at = across;  // the side across leaves the same corner
      } while (at != kNoSide && fans.of_corners[at.triangle][at.side] == kUnseen);
      at = {t, c};
      while (true) {
        const TriangleSide across = neighbors[at.triangle][at.side];
        if (across == kNoSide) break;
        at = {across.triangle, static_cast<std::uint8_t>((across.side + 1) % 3)};
        if (fans.of_corners[at.triangle][at.side] != kUnseen) break;
        fans.of_corners[at.triangle][at.side] = fan;
      }
    }
  return fans;
}

std::vector<BoundaryLoop> boundary_loops(const Neighbors& neighbors) {
  std::vector<BoundaryLoop> loops;
  std::vector<std::array<char, 3>> is_seen(neighbors.size(), {0, 0, 0});
  for (std::uint32_t t = 0; t < neighbors.size(); ++t)
    for (std::uint8_t s = 0; s < 3; ++s) {
      if (neighbors[t][s] != kNoSide || is_seen[t][s]) continue;
      BoundaryLoop loop;
      TriangleSide at{t, s};
      do {
        is_seen[at.triangle][at.side] = 1;
        loop.push_back(at);
        // Around the vertex where this side ends, to the next side without a neighbor.
        at.side = static_cast<std::uint8_t>((at.side + 1) % 3);
        while (neighbors[at.triangle][at.side] != kNoSide) {
          const TriangleSide across = neighbors[at.triangle][at.side];
          at = {across.triangle, static_cast<std::uint8_t>((across.side + 1) % 3)};
        }
      } while (!is_seen[at.triangle][at.side]);
      loops.push_back(std::move(loop));
    }
  return loops;
}

Component describe_component(const TexturedMesh& mesh, const Neighbors& neighbors,
                             std::vector<std::uint32_t> triangles) {
  Neighbors inside(triangles.size(), {kNoSide, kNoSide, kNoSide});
  Component component;
  std::int64_t open_sides = 0;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    component.area_m2 += mesh.area_vector(triangles[i]).norm();
    for (std::size_t s = 0; s < 3; ++s) {
      const TriangleSide other = neighbors[triangles[i]][s];
      const auto at = std::lower_bound(triangles.begin(), triangles.end(), other.triangle);
      if (other != kNoSide && at != triangles.end() && *at == other.triangle)
        inside[i][s] = {static_cast<std::uint32_t>(at - triangles.begin()), other.side};
      else
        ++open_sides;
    }
  }
  const auto count = static_cast<std::int64_t>(triangles.size());
  component.boundary_loops = static_cast<int>(boundary_loops(inside).size());
  component.genus =
      genus_of(find_fans(inside).count, (3 * count + open_sides) / 2, count, component.boundary_loops);
  component.triangles = std::move(triangles);
  return component;
}

std::vector<Component> find_components(const TexturedMesh& mesh, const Neighbors& neighbors) {
  std::vector<Component> components;
  std::vector<std::uint32_t> component_of(mesh.triangle_count());
  std::vector<char> is_seen(mesh.triangle_count(), 0);
  for (std::uint32_t t = 0; t < mesh.triangle_count(); ++t) {
    if (is_seen[t]) continue;
    Component component;
    component.triangles = collect(t, neighbors, is_seen);
    for (const auto member : component.triangles) {
      component_of[member] = static_cast<std::uint32_t>(components.size());
      component.area_m2 += mesh.area_vector(member).norm();
    }
    components.push_back(std::move(component));
  }

  std::vector<std::int64_t> fan_count(components.size(), 0), open_sides(components.size(), 0);
  const Fans fans = find_fans(neighbors);
  std::vector<char> is_counted(fans.count, 0);
  for (std::uint32_t t = 0; t < mesh.triangle_count(); ++t)
    for (std::size_t c = 0; c < 3; ++c) {
      char& counted = is_counted[fans.of_corners[t][c]];
      fan_count[component_of[t]] += !counted;
      counted = 1;
      open_sides[component_of[t]] += neighbors[t][c] == kNoSide;
    }
  for (const BoundaryLoop& loop : boundary_loops(neighbors))
    ++components[component_of[loop[0].triangle]].boundary_loops;
  for (std::size_t i = 0; i < components.size(); ++i) {
    Component& component = components[i];
    const auto triangles = static_cast<std::int64_t>(component.triangles.size());
    component.genus =
        genus_of(fan_count[i], (3 * triangles + open_sides[i]) / 2, triangles, component.boundary_loops);
  }
  return components;
}

}  // namespace hilbrush
