#include "sampling/model/renumber.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>
#include <vector>

#include "sampling/base/union_find.h"

namespace hilbrush {
namespace {

/// With vertices, colors and neighbors some two megabytes.
constexpr std::size_t kInCache = 8192;
constexpr int kBits = 16;  ///< an axis: finer than any triangle of a large mesh
constexpr std::uint32_t kUnnumbered = ~std::uint32_t{0};

/// Where a triangle is to go; equal ones keep their order.
struct Place {
  std::uint32_t part;
  std::uint64_t morton;
  std::uint32_t triangle;

  bool operator<(const Place& other) const {
    return std::tie(part, morton, triangle) < std::tie(other.part, other.morton, other.triangle);
  }
};

/// By triangle, which of the parts that hang together it belongs to, in order of their first triangles.
std::vector<std::uint32_t> parts_of(const TexturedMesh& mesh) {
  UnionFind sets(mesh.vertices.size());
  for (const auto& corners : mesh.triangles) {
    sets.unite(corners[0], corners[1]);
    sets.unite(corners[0], corners[2]);
  }
  std::vector<std::uint32_t> number(mesh.vertices.size(), kUnnumbered), parts;
  parts.reserve(mesh.triangle_count());
  std::uint32_t count = 0;
  for (const auto& corners : mesh.triangles) {
    std::uint32_t& part = number[sets.root(corners[0])];
    if (part == kUnnumbered) part = count++;
    parts.push_back(part);
  }
  return parts;
}

/// Bits of x, y and z in turn, from the largest down. @pre coordinates in [0, 1]
std::uint64_t morton_key(const Eigen::Vector3d& place) {
  std::uint64_t key = 0;
  const Eigen::Vector3d scaled = place * ((1 << kBits) - 1);
  for (int bit = kBits - 1; bit >= 0; --bit)
    for (int k = 0; k < 3; ++k) key = key << 1 | (static_cast<std::uint64_t>(scaled[k]) >> bit & 1);
  return key;
}

template <class Value>
void permute(std::vector<Value>& values, const std::vector<Place>& places) {
  std::vector<Value> permuted;
  permuted.reserve(values.size());
  for (const Place& place : places) permuted.push_back(values[place.triangle]);
  values = std::move(permuted);
}

void renumber_vertices(TexturedMesh& mesh) {
  std::vector<std::uint32_t> number(mesh.vertices.size(), kUnnumbered);
  std::vector<Eigen::Vector3d> vertices;
  vertices.reserve(mesh.vertices.size());
  for (auto& corners : mesh.triangles)
    for (std::uint32_t& v : corners) {
      if (number[v] == kUnnumbered) {
        number[v] = static_cast<std::uint32_t>(vertices.size());
        vertices.push_back(mesh.vertices[v]);
      }
      v = number[v];
    }
  mesh.vertices = std::move(vertices);
}

}  // namespace

void renumber_along_surface(TexturedMesh& mesh) {
  if (mesh.triangle_count() <= kInCache) return;
  const auto [low, high] = bounds(mesh);
  const double extent = (high - low).maxCoeff();
  const std::vector<std::uint32_t> parts = parts_of(mesh);
  std::vector<Place> places(mesh.triangle_count());
  for (std::uint32_t t = 0; t < places.size(); ++t) {
    const Eigen::Vector3d middle = (mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3;
    places[t] = {parts[t], morton_key((middle - low) / extent), t};
  }
  std::sort(places.begin(), places.end());
  permute(mesh.triangles, places);
  permute(mesh.corner_uv, places);
  permute(mesh.corner_luminance, places);
  permute(mesh.material_index, places);
  renumber_vertices(mesh);
}

}  // namespace hilbrush
