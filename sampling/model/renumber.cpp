#include "sampling/model/renumber.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>
#include <vector>

#include "sampling/base/union_find.h"

namespace hilbrush {
namespace {

/// Triangles of a mesh that fits in the cache: with vertices, colors and neighbors about two megabytes.
constexpr std::size_t kTrianglesInCache = 8192;
constexpr int kBits = 16;  ///< of each axis: a grid finer than the triangles of a large mesh
constexpr std::uint32_t kUnnumbered = ~std::uint32_t{0};

/// What triangles are sorted by; those in one grid cell keep their order.
struct SortKey {
  std::uint32_t part;
  std::uint64_t morton;
  std::uint32_t triangle;

  bool operator<(const SortKey& other) const {
    return std::tie(part, morton, triangle) < std::tie(other.part, other.morton, other.triangle);
  }
};

/// By triangle, which of the connected parts it belongs to; parts are numbered in the order of their first
/// triangles.
std::vector<std::uint32_t> parts_of(const TexturedMesh& mesh) {
  UnionFind sets(mesh.vertices.size());
  for (const auto& corners : mesh.triangles) {
    sets.unite(corners[0], corners[1]);
    sets.unite(corners[0], corners[2]);
  }
  std::vector<std::uint32_t> number(mesh.vertices.size(), kUnnumbered);
  std::vector<std::uint32_t> parts;
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
std::uint64_t morton_key(const Eigen::Vector3d& point) {
  std::uint64_t key = 0;
  const Eigen::Vector3d scaled = point * ((1 << kBits) - 1);
  for (int bit = kBits - 1; bit >= 0; --bit)
    for (int k = 0; k < 3; ++k) key = key << 1 | (static_cast<std::uint64_t>(scaled[k]) >> bit & 1);
  return key;
}

template <class Value>
void permute(std::vector<Value>& values, const std::vector<SortKey>& keys) {
  std::vector<Value> permuted;
  permuted.reserve(values.size());
  for (const SortKey& key : keys) permuted.push_back(values[key.triangle]);
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
  if (mesh.triangle_count() <= kTrianglesInCache) return;
  const auto [low, high] = bounds(mesh);
  const double extent = (high - low).maxCoeff();
  const std::vector<std::uint32_t> parts = parts_of(mesh);
  std::vector<SortKey> keys(mesh.triangle_count());
  for (std::uint32_t t = 0; t < keys.size(); ++t) {
    const Eigen::Vector3d middle = (mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3;
    keys[t] = {parts[t], morton_key((middle - low) / extent), t};
  }
  std::sort(keys.begin(), keys.end());
  permute(mesh.triangles, keys);
  permute(mesh.corner_uv, keys);
  permute(mesh.corner_luminance, keys);
  permute(mesh.material_index, keys);
  renumber_vertices(mesh);
}

}  // namespace hilbrush
