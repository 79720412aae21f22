#pragma once
#include <array>
#include <cstdint>
#include <vector>

/// Which triangles meet at which edge: the adjacency that repair, components and cutting share.
namespace hilbrush {

using Triangle = std::array<std::uint32_t, 3>;

/// Side `side` of a triangle runs from its corner `side` to the next one.
struct TriangleSide {
  std::uint32_t triangle = 0;
  std::uint8_t side = 0;
  bool operator==(const TriangleSide&) const = default;
};

/// The sides of all triangles that lie on one edge of the mesh, in order of their triangles.
struct EdgeGroup {
  std::uint32_t from = 0;   ///< the vertex with the smaller index
  std::uint32_t to = 0;     ///< the other one
  std::uint32_t begin = 0;  ///< of the edge's sides in EdgeTable::sides
  std::uint32_t end = 0;    ///< one past the last one
};

struct EdgeTable {
  std::vector<TriangleSide> sides;
  std::vector<EdgeGroup> groups;
};

/// Cost O(n log n).
EdgeTable edge_table(const std::vector<Triangle>& triangles);

/// Per triangle and side: the triangle side across it, or kNoSide.
inline constexpr std::uint32_t kNoTriangle = ~std::uint32_t{0};
inline constexpr TriangleSide kNoSide{kNoTriangle, 0};
using Neighbors = std::vector<std::array<TriangleSide, 3>>;

/// Two triangles are neighbors if they alone share an edge and pass it in opposite directions.
Neighbors find_neighbors(const std::vector<Triangle>& triangles);

}  // namespace hilbrush
