#include "sampling/disk/cut_to_disk.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <optional>
#include <utility>

#include "sampling/base/union_find.h"
#include "sampling/disk/refine.h"
#include "sampling/disk/shortest_paths.h"

namespace hilbrush {
namespace {

/// Sides of an outer boundary are split until none is longer than this share of the whole boundary.
constexpr double kMaxBoundarySide = 1. / 16;
/// Halving a side of length l until its parts are short enough takes less than 2 l / (kMaxBoundarySide *
/// whole boundary) splits, and all sides together this many. More are needed only where rounding keeps halves
/// as long as their whole: on a boundary of a few last digits of its coordinates.
constexpr int kMaxBoundarySplits = static_cast<int>(2 / kMaxBoundarySide);
/// Faces after refine(): of the whole mesh, shared out by area, and of one component at most.
constexpr double kRefinedMesh = 40'000;
constexpr double kRefinedComponent = 5000;
/// The same after split_towards_delaunay(). A component grows to at most kMaxGrowth times its faces;
/// kMinGrowth times is allowed to every component, whatever the other limits say.
constexpr double kDelaunayMesh = 200'000;
constexpr double kDelaunayComponent = 80'000;
constexpr double kMaxGrowth = 16;
constexpr double kMinGrowth = 1.1;
/// A disk whose boundary, over the root of its area, is shorter is a bag: it is slit from its mouth to the
/// far end.
constexpr double kMinBoundary = 1.2;
/// This many roots are tried for the loops that open handles.
constexpr int kRootCount = 4;

/// Shortest paths along edges from one vertex to all others.
struct Distances {
  std::vector<double> to_vertex;
  std::vector<TriangleSide> last_side;  ///< the side that arrives at the vertex (or leaves it, on a boundary)

  std::uint32_t farthest() const {
    return static_cast<std::uint32_t>(std::max_element(to_vertex.begin(), to_vertex.end()) -
                                      to_vertex.begin());
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

Distances distances_from(const std::vector<std::uint32_t>& sources, const Disk& disk, const Arcs& arcs) {
  Distances d;
  d.last_side.assign(disk.positions().size(), kNoSide);
  d.to_vertex = shortest_distances(disk.positions().size(), sources, [&](std::uint32_t v, auto reach) {
    for (std::uint32_t i = arcs.begin[v]; i < arcs.begin[v + 1]; ++i) {
      const Arcs::Arc& arc = arcs.arcs[i];
      if (reach(arc.to, disk.length(arc.side))) d.last_side[arc.to] = arc.side;
    }
  });
  return d;
}

std::vector<TriangleSide> path_to_source(const Disk& disk, const Distances& distances, std::uint32_t v) {
  std::vector<TriangleSide> path;
  for (; distances.last_side[v] != kNoSide; v = disk.from(path.back()))
    path.push_back(distances.last_side[v]);
  return path;
}

/// The edges of a closed surface's approximate diameter, from its far end to the near one.
std::vector<TriangleSide> diameter(const Disk& disk) {
  const Arcs arcs(disk);
  const std::uint32_t one_end = distances_from({0}, disk, arcs).farthest();
  const Distances distances = distances_from({one_end}, disk, arcs);
  return path_to_source(disk, distances, distances.farthest());
}

double length_of(const Disk& disk, const std::vector<TriangleSide>& sides) {
  double sum = 0;
  for (const TriangleSide s : sides) sum += disk.length(s);
  return sum;
}

/// Longest loop first.
std::vector<BoundaryLoop> sorted_loops(const Disk& disk) {
  std::vector<BoundaryLoop> loops = boundary_loops(disk.neighbors());
  std::ranges::stable_sort(loops, std::greater<>(),
                           [&](const BoundaryLoop& loop) { return length_of(disk, loop); });
  return loops;
}

/// Cutting a surface along shortest paths from source to source leaves a disk. Each such path consists of two
/// paths of the forest of shortest paths and one edge between them, which closes it; these edges are
/// returned. They are the edges that are neither in the forest nor crossed by a spanning tree of the faces,
/// which takes the edges of the longest paths first. With one vertex as the source the paths are loops
/// (Erickson and Whittlesey, "Greedy optimal homotopy and homology generators", 2005), with the boundaries as
/// sources arcs between them.
std::vector<TriangleSide> closing_edges(const Disk& disk, const Distances& distances) {
  struct Candidate {
    double length;
    TriangleSide side;
  };
  std::vector<Candidate> candidates;
  for (std::uint32_t f = 0; f < disk.faces().size(); ++f)
    for (std::uint8_t s = 0; s < 3; ++s) {
      const TriangleSide side{f, s}, across = disk.neighbors()[f][s];
      if (across == kNoSide || across.triangle < f || (across.triangle == f && across.side < s)) continue;
      const TriangleSide to_from = distances.last_side[disk.from(side)],
                         to_to = distances.last_side[disk.to(side)];
      if (to_from == side || to_from == across || to_to == side || to_to == across) continue;
      candidates.push_back(
          {distances.to_vertex[disk.from(side)] + distances.to_vertex[disk.to(side)] + disk.length(side),
           side});
    }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.length > b.length; });
  UnionFind sets(disk.faces().size());
  std::vector<TriangleSide> closing;
  for (const Candidate& candidate : candidates) {
    const std::uint32_t across = disk.neighbors()[candidate.side.triangle][candidate.side.side].triangle;
    if (!sets.unite(candidate.side.triangle, across)) closing.push_back(candidate.side);
  }
  return closing;
}

/// The closing edges and the paths from both ends of each to a source. With a single source, without the stem
/// that all loops share.
std::vector<TriangleSide> cut_graph(const Disk& disk, const Distances& distances,
                                    const std::vector<char>& is_boundary) {
  std::vector<TriangleSide> cut = closing_edges(disk, distances);
  std::vector<char> is_reached(disk.positions().size(), 0);
  for (std::size_t i = 0, n = cut.size(); i < n; ++i)
    for (std::uint32_t v : {disk.from(cut[i]), disk.to(cut[i])})
      for (; !is_reached[v] && distances.last_side[v] != kNoSide; v = disk.from(cut.back())) {
        is_reached[v] = 1;
        cut.push_back(distances.last_side[v]);
      }
  std::vector<std::vector<std::size_t>> edges_at(disk.positions().size());
  for (std::size_t i = 0; i < cut.size(); ++i)
    for (const auto v : {disk.from(cut[i]), disk.to(cut[i])}) edges_at[v].push_back(i);
  std::vector<char> is_dropped(cut.size(), 0);
  for (std::uint32_t v = 0; v < edges_at.size(); ++v)
    for (std::uint32_t end = v; edges_at[end].size() == 1 && !is_boundary[end];) {
      const std::size_t edge = edges_at[end].front();
      is_dropped[edge] = 1;
      const std::uint32_t other = disk.from(cut[edge]) == end ? disk.to(cut[edge]) : disk.from(cut[edge]);
      edges_at[end].clear();
      std::erase(edges_at[other], edge);
      end = other;
    }
  std::vector<TriangleSide> kept;
  for (std::size_t i = 0; i < cut.size(); ++i)
    if (!is_dropped[i]) kept.push_back(cut[i]);
  return kept;
}

std::vector<char> boundary_vertices(const Disk& disk) {
  std::vector<char> is_boundary(disk.positions().size(), 0);
  for (std::uint32_t f = 0; f < disk.faces().size(); ++f)
    for (std::uint8_t s = 0; s < 3; ++s)
      if (disk.neighbors()[f][s] == kNoSide)
        is_boundary[disk.from({f, s})] = is_boundary[disk.to({f, s})] = 1;
  return is_boundary;
}

/// The shortest of the cut graphs from a few far-apart vertices.
std::vector<TriangleSide> shortest_loops(const Disk& disk) {
  const Arcs arcs(disk);
  const std::vector<char> none(disk.positions().size(), 0);
  std::vector<TriangleSide> best;
  std::uint32_t root = 0;
  for (int i = 0; i < kRootCount; ++i) {
    const Distances distances = distances_from({root}, disk, arcs);
    std::vector<TriangleSide> cut = cut_graph(disk, distances, none);
    if (best.empty() || length_of(disk, cut) < length_of(disk, best)) best = std::move(cut);
    // From the first root to far ends, then from the middle of the best cut.
    root = i + 2 < kRootCount ? distances.farthest() : disk.from(best[best.size() / 2]);
  }
  return best;
}

std::vector<TriangleSide> shortest_arcs(const Disk& disk, const std::vector<char>& is_boundary) {
  std::vector<std::uint32_t> sources;
  for (std::uint32_t v = 0; v < is_boundary.size(); ++v)
    if (is_boundary[v]) sources.push_back(v);
  return cut_graph(disk, distances_from(sources, disk, Arcs(disk)), is_boundary);
}

/// Places where the cut meets itself or a boundary.
std::vector<Eigen::Vector3d> forks_of(const Disk& disk, const std::vector<TriangleSide>& cut,
                                      const std::vector<char>& is_boundary) {
  std::vector<int> degree(disk.positions().size(), 0);
  for (const TriangleSide side : cut) {
    ++degree[disk.from(side)];
    ++degree[disk.to(side)];
  }
  std::vector<Eigen::Vector3d> forks;
  for (std::size_t v = 0; v < degree.size(); ++v)
    if (degree[v] > (is_boundary[v] ? 0 : 2)) forks.push_back(disk.positions()[v]);
  return forks;
}

/// False if that takes more splits than kMaxBoundarySplits.
bool split_long_sides(CutDisk& cut) {
  const std::uint32_t start = cut.disk.from(cut.outer[0]);
  const double longest = kMaxBoundarySide * length_of(cut.disk, cut.outer);
  int splits = 0;
  for (bool is_done = false; !is_done;) {
    is_done = true;
    std::vector<char> is_split(cut.disk.faces().size(), 0);
    for (const TriangleSide s : cut.outer) {
      // Splitting renumbers the other sides of the face, so each face is split once a round.
      if (cut.disk.length(s) <= longest || std::exchange(is_split[s.triangle], 1)) continue;
      if (++splits > kMaxBoundarySplits) return false;
      cut.disk.split_edge(s);
      is_done = false;
    }
    if (!is_done) cut.outer = loop_from(cut.disk, start);
  }
  return true;
}

/// The vertices of a loop that lie at one of the places.
std::vector<std::uint32_t> vertices_at(const Disk& disk, const BoundaryLoop& loop,
                                       const std::vector<Eigen::Vector3d>& places) {
  std::vector<std::uint32_t> vertices;
  for (const TriangleSide s : loop)
    if (std::ranges::find(places, disk.positions()[disk.from(s)]) != places.end())
      vertices.push_back(disk.from(s));
  return vertices;
}

void refine_for_map(Disk& disk, double area_share) {
  refine(disk, static_cast<std::size_t>(std::min(kRefinedMesh * area_share, kRefinedComponent)));
  const auto n = static_cast<double>(disk.faces().size());
  const double budget = std::min({kDelaunayMesh * area_share, kDelaunayComponent, kMaxGrowth * n});
  const double most = std::max(kMinGrowth * n, budget);
  split_towards_delaunay(disk, static_cast<std::size_t>(most));
}

/// Where the boundary loop shall begin, and the corners of the shape, as positions: vertices change their
/// numbers when cuts are opened.
struct Marks {
  std::vector<Eigen::Vector3d> forks;
  std::optional<TriangleSide> start;
};

/// Takes the edges apart and finds the outer loop. A text says why it failed.
std::optional<Failure> open_cuts(CutDisk& cut, const std::vector<TriangleSide>& edges, const Marks& marks) {
  cut.is_cut = cut.is_cut || !edges.empty();
  cut.cut_length_m += length_of(cut.disk, edges);
  for (const TriangleSide side : edges) cut.disk.cut_edge(side);
  cut.disk.finish_cuts();
  std::vector<BoundaryLoop> loops = boundary_loops(cut.disk.neighbors());
  if (loops.size() != 1) return Failure{"no cut was found that makes it a disk"};
  cut.outer = marks.start ? loop_from(cut.disk, cut.disk.from(*marks.start)) : std::move(loops.front());
  cut.forks = vertices_at(cut.disk, cut.outer, marks.forks);
  if (!split_long_sides(cut)) return Failure{"it is too small for the precision of its coordinates"};
  return {};
}

/// Fills all loops but the longest, if there are more holes than may be cut open.
void fill_shorter_loops(Disk& disk, std::size_t max_holes) {
  const std::vector<BoundaryLoop> loops = sorted_loops(disk);
  if (loops.size() <= max_holes + 1) return;
  for (std::size_t i = 1; i < loops.size(); ++i) disk.fill(loops[i]);
}

}  // namespace

BoundaryLoop loop_from(const Disk& disk, std::uint32_t vertex) {
  BoundaryLoop loop = std::move(boundary_loops(disk.neighbors()).front());
  const auto first =
      std::find_if(loop.begin(), loop.end(), [&](TriangleSide s) { return disk.from(s) == vertex; });
  std::rotate(loop.begin(), first, loop.end());
  return loop;
}

Result<CutDisk> cut_to_disk(const TexturedMesh& mesh, const Neighbors& neighbors, const Component& component,
                            const CutOptions& options) {
  if (component.genus < 0) return Failure{"its triangles do not form a surface"};
  CutDisk cut{Disk(mesh, neighbors, component.triangles), {}, false, 0, {}};
  Disk& disk = cut.disk;
  refine_for_map(disk, options.area_share);
  fill_shorter_loops(disk, options.max_holes);
  const std::vector<char> is_boundary = boundary_vertices(disk);
  std::vector<TriangleSide> edges;
  Marks marks;
  if (component.boundary_loops > 0) {
    edges = shortest_arcs(disk, is_boundary);
  } else if (component.genus > 0) {
    edges = shortest_loops(disk);
  } else {
    edges = diameter(disk);
    marks.start = edges.back();
  }
  if (!marks.start) marks.forks = forks_of(disk, edges, is_boundary);
  if (auto failure = open_cuts(cut, edges, marks)) return *std::move(failure);
  if (length_of(disk, cut.outer) < kMinBoundary * std::sqrt(component.area_m2)) {
    std::vector<std::uint32_t> all(disk.positions().size());
    std::iota(all.begin(), all.end(), 0u);
    extend_cut(cut, all);
  }
  return cut;
}

bool extend_cut(CutDisk& cut, const std::vector<std::uint32_t>& vertices) {
  std::vector<std::uint32_t> sources;
  for (const TriangleSide s : cut.outer) sources.push_back(cut.disk.from(s));
  const Distances distances = distances_from(sources, cut.disk, Arcs(cut.disk));
  const auto deepest =
      std::ranges::max_element(vertices, {}, [&](std::uint32_t v) { return distances.to_vertex[v]; });
  if (deepest == vertices.end() || !(distances.to_vertex[*deepest] > 0)) return false;
  const std::vector<TriangleSide> path = path_to_source(cut.disk, distances, *deepest);
  Marks marks;
  for (const auto v : cut.forks) marks.forks.push_back(cut.disk.positions()[v]);
  if (cut.forks.empty())
    marks.start = path.back();
  else
    marks.forks.push_back(cut.disk.positions()[cut.disk.from(path.back())]);
  CutDisk extended = cut;
  if (open_cuts(extended, path, marks)) return false;
  cut = std::move(extended);
  return true;
}

}  // namespace hilbrush
