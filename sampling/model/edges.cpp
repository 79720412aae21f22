#include "sampling/model/edges.h"

#include <algorithm>

namespace hilbrush {

EdgeTable edge_table(const std::vector<Triangle>& triangles) {
  struct Entry {
    std::uint32_t from;
    std::uint32_t to;
    TriangleSide side;
  };
  std::vector<Entry> entries;
  entries.reserve(3 * triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    for (std::uint8_t s = 0; s < 3; ++s) {
      const std::uint32_t a = triangles[t][s];
      const std::uint32_t b = triangles[t][(s + 1) % 3];
      entries.push_back({std::min(a, b), std::max(a, b), {t, s}});
    }
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    if (a.from != b.from) return a.from < b.from;
    if (a.to != b.to) return a.to < b.to;
    if (a.side.triangle != b.side.triangle) return a.side.triangle < b.side.triangle;
    return a.side.side < b.side.side;
  });

  EdgeTable table;
  table.sides.reserve(entries.size());
  for (const Entry& e : entries) {
    const auto index = static_cast<std::uint32_t>(table.sides.size());
    if (table.groups.empty() || table.groups.back().from != e.from || table.groups.back().to != e.to)
      table.groups.push_back({e.from, e.to, index, index});
    table.sides.push_back(e.side);
    ++table.groups.back().end;
  }
  return table;
}

Neighbors find_neighbors(const std::vector<Triangle>& triangles) {
  Neighbors neighbors(triangles.size(), {kNoSide, kNoSide, kNoSide});
  const EdgeTable table = edge_table(triangles);
  for (const EdgeGroup& group : table.groups) {
    if (group.end - group.begin != 2) continue;
    const TriangleSide a = table.sides[group.begin];
    const TriangleSide b = table.sides[group.begin + 1];
    if (a.triangle == b.triangle || triangles[a.triangle][a.side] == triangles[b.triangle][b.side]) continue;
    neighbors[a.triangle][a.side] = b;
    neighbors[b.triangle][b.side] = a;
  }
  return neighbors;
}

}  // namespace hilbrush
