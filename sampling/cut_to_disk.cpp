#include "sampling/cut_to_disk.h"

#include <algorithm>
#include <limits>
#include <queue>
#include <utility>

namespace hilbrush {
namespace {

/// Sides of an outer boundary are split until none is longer than this share of all of it.
constexpr double kLongestBoundarySide = 1. / 16;

/// Shortest paths along edges from one vertex to all others.
struct Distances {
  std::vector<double> to_vertex;
  std::vector<TriangleSide> last_side;  ///< the side that arrives at the vertex (or leaves it, on a boundary)

  std::uint32_t farthest() const {
    return static_cast<std::uint32_t>(std::max_element(to_vertex.begin(), to_vertex.end()) - to_vertex.begin());
  }
};

/// Both directions of every edge, by the vertex where they begin.
struct Arcs {
  struct Arc {
    std::uint32_t to;
    TriangleSide side;
  };
  std::vector<std::uint32_t> begin;
  std::vector<Arc> arcs;

  explicit Arcs(const Disk& disk) : begin(disk.positions().size() + 1, 0) {
    for (const Triangle& face : disk.faces())
      for (const auto v : face) ++begin[v + 1];
    for (std::size_t v = 1; v < begin.size(); ++v) begin[v] += begin[v - 1];
    arcs.resize(3 * disk.faces().size());
    std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
    for (std::uint32_t f = 0; f < disk.faces().size(); ++f)
      for (std::uint8_t s = 0; s < 3; ++s) arcs[next[disk.faces()[f][s]]++] = {disk.to({f, s}), {f, s}};
  }
};

/// Of a closed surface, where every edge has an arc each way.
Distances distances_from(std::uint32_t source, const Disk& disk, const Arcs& arcs) {
  Distances d;
  d.to_vertex.assign(disk.positions().size(), std::numeric_limits<double>::infinity());
  d.last_side.assign(disk.positions().size(), kNoSide);
  d.to_vertex[source] = 0;
  using Entry = std::pair<double, std::uint32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  queue.push({0, source});
  while (!queue.empty()) {
    const auto [distance, v] = queue.top();
    queue.pop();
    if (distance > d.to_vertex[v]) continue;
    for (std::uint32_t i = arcs.begin[v]; i < arcs.begin[v + 1]; ++i) {
      const auto& arc = arcs.arcs[i];
      const double longer = distance + disk.length(arc.side);
      if (longer >= d.to_vertex[arc.to]) continue;
      d.to_vertex[arc.to] = longer;
      d.last_side[arc.to] = arc.side;
      queue.push({longer, arc.to});
    }
  }
  return d;
}

/// Cuts a closed surface of genus 0 open along its approximate diameter. Returns the side with which the boundary
/// begins.
TriangleSide cut_along_diameter(Disk& disk) {
  const Arcs arcs(disk);
  const std::uint32_t one_end = distances_from(0, disk, arcs).farthest();
  const Distances distances = distances_from(one_end, disk, arcs);
  std::vector<TriangleSide> path;
  for (std::uint32_t v = distances.farthest(); v != one_end; v = disk.from(path.back()))
    path.push_back(distances.last_side[v]);
  for (const TriangleSide s : path) disk.cut_edge(s);
  disk.finish_cuts();
  return path.back();
}

double length_of(const Disk& disk, const BoundaryLoop& loop) {
  double sum = 0;
  for (const TriangleSide s : loop) sum += disk.length(s);
  return sum;
}

void split_long_sides(Disk& disk, BoundaryLoop& loop) {
  const double longest = kLongestBoundarySide * length_of(disk, loop);
  BoundaryLoop result;
  for (TriangleSide s : loop) {
    // Each split leaves the first half as side s, and the second half as side 0 of the newest face.
    std::vector<TriangleSide> parts{s};
    for (std::size_t i = 0; i < parts.size();) {
      if (disk.length(parts[i]) <= longest || parts.size() > 64) {
        ++i;
        continue;
      }
      disk.split_edge(parts[i]);
      const TriangleSide second{static_cast<std::uint32_t>(disk.faces().size() - 1), 0};
      parts.insert(parts.begin() + static_cast<std::ptrdiff_t>(i) + 1, second);
    }
    result.insert(result.end(), parts.begin(), parts.end());
  }
  loop = std::move(result);
}

}  // namespace

std::optional<CutDisk> cut_to_disk(const TexturedMesh& mesh, const Neighbours& neighbours, const Component& component,
                                   std::string& reason) {
  if (component.genus != 0) {
    reason = component.genus < 0
                 ? "its triangles do not form a surface"
                 : "it has " + std::to_string(component.genus) + (component.genus == 1 ? " handle" : " handles");
    return std::nullopt;
  }
  CutDisk cut{Disk(mesh, neighbours, component.triangles), {}, component.boundary_loops == 0};
  if (cut.is_cut) {
    const TriangleSide start = cut_along_diameter(cut.disk);
    cut.outer = std::move(boundary_loops(cut.disk.neighbours()).front());
    std::rotate(cut.outer.begin(), std::find(cut.outer.begin(), cut.outer.end(), start), cut.outer.end());
  } else {
    std::vector<BoundaryLoop> loops = boundary_loops(cut.disk.neighbours());
    const auto outer = std::max_element(loops.begin(), loops.end(), [&](const BoundaryLoop& a, const BoundaryLoop& b) {
      return length_of(cut.disk, a) < length_of(cut.disk, b);
    });
    std::iter_swap(loops.begin(), outer);
    for (std::size_t i = 1; i < loops.size(); ++i) cut.disk.fill(loops[i]);
    cut.outer = std::move(loops.front());
  }
  split_long_sides(cut.disk, cut.outer);
  return cut;
}

}  // namespace hilbrush
