#include "sampling/disk/cut_to_disk.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <numeric>
#include <queue>
#include <tuple>
#include <utility>

namespace hilbrush {
namespace {

/// Sides of an outer boundary are split until none is longer than this share of all of it.
constexpr double kLongestBoundarySide = 1. / 16;
/// Coarser components are refined: a box of twelve triangles has too few vertices for a smooth map.
constexpr std::size_t kFewestFaces = 500;
/// A hole with a longer rim, as a share of the outer one, is joined to it by a cut instead of filled: an open tube
/// becomes a strip.
constexpr double kLongestFilledRim = .6;

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

/// Splits the longest edges until there are enough faces.
void refine(Disk& disk) {
  using Entry = std::tuple<double, std::uint32_t, std::uint8_t>;
  std::priority_queue<Entry> queue;
  const auto push_sides = [&](std::uint32_t f) {
    for (std::uint8_t s = 0; s < 3; ++s) queue.push({disk.length({f, s}), f, s});
  };
  for (std::uint32_t f = 0; f < disk.faces().size(); ++f) push_sides(f);
  while (disk.faces().size() < kFewestFaces) {
    const auto [length, f, s] = queue.top();
    queue.pop();
    if (disk.length({f, s}) != length) continue;  // has been split since
    const TriangleSide across = disk.neighbours()[f][s];
    const auto first_new = static_cast<std::uint32_t>(disk.faces().size());
    disk.split_edge({f, s});
    push_sides(f);
    if (across != kNoSide) push_sides(across.triangle);
    for (std::uint32_t added = first_new; added < disk.faces().size(); ++added) push_sides(added);
  }
}

/// Along edges, but along a boundary only with its sides.
Distances distances_from(const std::vector<std::uint32_t>& sources, const Disk& disk, const Arcs& arcs) {
  Distances d;
  d.to_vertex.assign(disk.positions().size(), std::numeric_limits<double>::infinity());
  d.last_side.assign(disk.positions().size(), kNoSide);
  using Entry = std::pair<double, std::uint32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  for (const auto source : sources) {
    d.to_vertex[source] = 0;
    queue.push({0, source});
  }
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

/// Cuts a closed surface of genus 0 open along its approximate diameter. Returns the vertex at one end.
std::uint32_t cut_along_diameter(Disk& disk) {
  const Arcs arcs(disk);
  const std::uint32_t one_end = distances_from({0}, disk, arcs).farthest();
  const Distances distances = distances_from({one_end}, disk, arcs);
  std::vector<TriangleSide> path;
  for (std::uint32_t v = distances.farthest(); v != one_end; v = disk.from(path.back()))
    path.push_back(distances.last_side[v]);
  for (const TriangleSide s : path) disk.cut_edge(s);
  disk.finish_cuts();
  return disk.from(path.back());
}

double length_of(const Disk& disk, const BoundaryLoop& loop) {
  double sum = 0;
  for (const TriangleSide s : loop) sum += disk.length(s);
  return sum;
}

std::vector<std::uint32_t> vertices_of(const Disk& disk, const BoundaryLoop& loop) {
  std::vector<std::uint32_t> vertices;
  for (const TriangleSide s : loop) vertices.push_back(disk.from(s));
  return vertices;
}

/// Longest loop first.
std::vector<BoundaryLoop> sorted_loops(const Disk& disk) {
  std::vector<BoundaryLoop> loops = boundary_loops(disk.neighbours());
  std::ranges::stable_sort(loops, std::greater<>(), [&](const BoundaryLoop& loop) { return length_of(disk, loop); });
  return loops;
}

/// Cuts along the shortest path from the longest loop to each other long one. Returns the places where the cuts end.
std::vector<Eigen::Vector3d> join_long_rims(Disk& disk) {
  std::vector<Eigen::Vector3d> ends;
  const double shortest_joined = kLongestFilledRim * length_of(disk, sorted_loops(disk).front());
  while (true) {
    const std::vector<BoundaryLoop> loops = sorted_loops(disk);
    if (loops.size() < 2 || length_of(disk, loops[1]) < shortest_joined) return ends;
    const Distances distances = distances_from(vertices_of(disk, loops[0]), disk, Arcs(disk));
    const auto rim = vertices_of(disk, loops[1]);
    std::uint32_t v = *std::ranges::min_element(rim, {}, [&](std::uint32_t r) { return distances.to_vertex[r]; });
    ends.push_back(disk.positions()[v]);
    std::vector<TriangleSide> path;
    for (; distances.last_side[v] != kNoSide; v = disk.from(distances.last_side[v]))
      path.push_back(distances.last_side[v]);
    ends.push_back(disk.positions()[v]);
    if (path.empty()) return ends;
    for (const TriangleSide s : path) disk.cut_edge(s);
    disk.finish_cuts();
  }
}

/// The loop of a disk, beginning at a vertex.
BoundaryLoop loop_from(const Disk& disk, std::uint32_t vertex) {
  BoundaryLoop loop = std::move(boundary_loops(disk.neighbours()).front());
  const auto first = std::find_if(loop.begin(), loop.end(), [&](TriangleSide s) { return disk.from(s) == vertex; });
  std::rotate(loop.begin(), first, loop.end());
  return loop;
}

void split_long_sides(CutDisk& cut) {
  const std::uint32_t start = cut.disk.from(cut.outer[0]);
  const double longest = kLongestBoundarySide * length_of(cut.disk, cut.outer);
  for (bool is_done = false; !is_done;) {
    is_done = true;
    std::vector<char> is_split(cut.disk.faces().size(), 0);
    for (const TriangleSide s : cut.outer) {
      // Splitting renumbers the other sides of the face, so each face is split once a round.
      if (cut.disk.length(s) <= longest || std::exchange(is_split[s.triangle], 1)) continue;
      cut.disk.split_edge(s);
      is_done = false;
    }
    if (!is_done) cut.outer = loop_from(cut.disk, start);
  }
}

/// Cuts along each closing edge and the paths from both its ends to the root of the tree, but for the stem that all
/// loops share.
/// Returns the places where cuts meet.
std::vector<Eigen::Vector3d> cut_loops(Disk& disk, const Distances& distances,
                                       const std::vector<TriangleSide>& closing) {
  std::vector<char> is_cut_vertex(disk.positions().size(), 0);
  std::vector<TriangleSide> cut = closing;
  for (const TriangleSide side : closing)
    for (std::uint32_t v : {disk.from(side), disk.to(side)})
      for (; !is_cut_vertex[v] && distances.last_side[v] != kNoSide; v = disk.from(distances.last_side[v])) {
        is_cut_vertex[v] = 1;
        cut.push_back(distances.last_side[v]);
      }
  std::vector<int> degree(disk.positions().size(), 0);
  for (const TriangleSide side : cut) ++degree[disk.from(side)], ++degree[disk.to(side)];
  // Only the root can be a loose end; take its stem away edge by edge.
  for (bool is_loose = true; is_loose;) {
    const auto loose = std::find_if(cut.begin(), cut.end(), [&](TriangleSide side) {
      return degree[disk.from(side)] == 1 || degree[disk.to(side)] == 1;
    });
    is_loose = loose != cut.end();
    if (!is_loose) break;
    --degree[disk.from(*loose)], --degree[disk.to(*loose)];
    cut.erase(loose);
  }
  std::vector<Eigen::Vector3d> forks;
  for (std::size_t v = 0; v < degree.size(); ++v)
    if (degree[v] > 2) forks.push_back(disk.positions()[v]);
  for (const TriangleSide side : cut) disk.cut_edge(side);
  disk.finish_cuts();
  return forks;
}

/// The vertices of a loop that lie at one of the places.
std::vector<std::uint32_t> vertices_at(const Disk& disk, const BoundaryLoop& loop,
                                       const std::vector<Eigen::Vector3d>& places) {
  std::vector<std::uint32_t> vertices;
  for (const TriangleSide s : loop)
    if (std::ranges::find(places, disk.positions()[disk.from(s)]) != places.end()) vertices.push_back(disk.from(s));
  return vertices;
}

/// Cuts a closed surface with handles open along the shortest loops through one vertex that leave no handle (Erickson
/// and Whittlesey, "Greedy optimal homotopy and homology generators", 2005): a tree of shortest paths, a tree of faces
/// across other edges, longest loops first; each edge that neither tree has closes a loop. Returns the places where
/// loops meet.
std::vector<Eigen::Vector3d> cut_handles(Disk& disk) {
  const Distances distances = distances_from({0}, disk, Arcs(disk));
  struct Candidate {
    double loop_length;
    TriangleSide side;
  };
  std::vector<Candidate> candidates;
  for (std::uint32_t f = 0; f < disk.faces().size(); ++f)
    for (std::uint8_t s = 0; s < 3; ++s) {
      const TriangleSide side{f, s}, across = disk.neighbours()[f][s];
      if (across.triangle < f || (across.triangle == f && across.side < s)) continue;
      const TriangleSide to_from = distances.last_side[disk.from(side)], to_to = distances.last_side[disk.to(side)];
      if (to_from == side || to_from == across || to_to == side || to_to == across) continue;
      candidates.push_back(
          {distances.to_vertex[disk.from(side)] + distances.to_vertex[disk.to(side)] + disk.length(side), side});
    }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.loop_length > b.loop_length; });
  std::vector<std::uint32_t> parent(disk.faces().size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto find = [&](std::uint32_t f) {
    while (parent[f] != f) f = parent[f] = parent[parent[f]];
    return f;
  };
  std::vector<TriangleSide> cut;
  for (const Candidate& candidate : candidates) {
    const std::uint32_t a = find(candidate.side.triangle);
    const std::uint32_t b = find(disk.neighbours()[candidate.side.triangle][candidate.side.side].triangle);
    if (a != b)
      parent[a] = b;
    else
      cut.push_back(candidate.side);
  }
  return cut_loops(disk, distances, cut);
}

}  // namespace

std::optional<CutDisk> cut_to_disk(const TexturedMesh& mesh, const Neighbours& neighbours, const Component& component,
                                   std::string& reason) {
  if (component.genus < 0) {
    reason = "its triangles do not form a surface";
    return std::nullopt;
  }
  CutDisk cut{
      Disk(mesh, neighbours, component.triangles), {}, component.boundary_loops == 0 || component.genus > 0, {}};
  Disk& disk = cut.disk;
  refine(disk);
  std::vector<Eigen::Vector3d> forks;
  std::uint32_t start = 0;
  if (!cut.is_cut) {
    forks = join_long_rims(disk);
    cut.is_cut = !forks.empty();
    const std::vector<BoundaryLoop> loops = sorted_loops(disk);
    start = disk.from(loops[0][0]);
    for (std::size_t i = 1; i < loops.size(); ++i) disk.fill(loops[i]);
  } else {
    for (const BoundaryLoop& loop : boundary_loops(disk.neighbours())) disk.fill(loop);
    if (component.genus > 0)
      forks = cut_handles(disk);
    else
      start = cut_along_diameter(disk);
  }
  const std::vector<BoundaryLoop> loops = boundary_loops(disk.neighbours());
  if (loops.size() != 1) {
    reason = "no cut was found that makes it a disk";
    return std::nullopt;
  }
  cut.outer = forks.empty() ? loop_from(disk, start) : loops.front();
  cut.forks = vertices_at(disk, cut.outer, forks);
  split_long_sides(cut);
  return cut;
}

}  // namespace hilbrush
