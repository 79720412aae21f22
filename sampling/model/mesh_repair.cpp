#include "sampling/model/mesh_repair.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "sampling/base/input_error.h"
#include "sampling/base/union_find.h"
#include "sampling/model/edges.h"
#include "sampling/model/near_vertices.h"
#include "sampling/model/renumber.h"

namespace hilbrush {
namespace {

/// Height over longest side: below this a triangle's area and normal are rounding errors.
constexpr double kMinHeightRatio = 1e-10;

/// Vertices nearer to each other than this share of the model's largest extent are one: .1 nm of 100 mm, far
/// below any feature, and above what a few operations in double precision leave of equal points.
constexpr double kWeldShare = 1e-9;
/// The holes of an almost closed part make at most this share of its area; the opening of a half sphere makes
/// half.
constexpr double kMaxHoleShare = .125;
constexpr double kMaxFanShare = .25;  ///< the same of the triangles that fill them

/// Keeps the triangles for which `keep` is true, with everything that belongs to them. Returns how many were
/// dropped.
template <class Keep>
std::size_t keep_triangles(TexturedMesh& mesh, Keep keep) {
  std::size_t kept = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!keep(t)) continue;
    mesh.triangles[kept] = mesh.triangles[t];
    mesh.corner_uv[kept] = mesh.corner_uv[t];
    mesh.corner_luminance[kept] = mesh.corner_luminance[t];
    mesh.material_index[kept] = mesh.material_index[t];
    ++kept;
  }
  const std::size_t dropped = mesh.triangles.size() - kept;
  mesh.triangles.resize(kept);
  mesh.corner_uv.resize(kept);
  mesh.corner_luminance.resize(kept);
  mesh.material_index.resize(kept);
  return dropped;
}

void turn_over(TexturedMesh& mesh, std::size_t t) {
  std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
  std::swap(mesh.corner_uv[t][1], mesh.corner_uv[t][2]);
  std::swap(mesh.corner_luminance[t][1], mesh.corner_luminance[t][2]);
}

bool has_usable_corners(const TexturedMesh& mesh, std::size_t t) {
  return std::ranges::all_of(mesh.triangles[t], [&](std::uint32_t v) {
    return v < mesh.vertices.size() && mesh.vertices[v].allFinite();
  });
}

/// The corner where the shortest side of a triangle begins, if that side is as good as a point compared with
/// the longest one.
std::optional<std::size_t> collapsed_side(const TexturedMesh& mesh, std::size_t t) {
  std::array<double, 3> length2{};
  for (std::size_t k = 0; k < 3; ++k)
    length2[k] = (mesh.corner(t, (k + 1) % 3) - mesh.corner(t, k)).squaredNorm();
  const auto shortest = std::min_element(length2.begin(), length2.end());
  const double longest2 = *std::max_element(length2.begin(), length2.end());
  if (!(*shortest > 0) || *shortest > kMinHeightRatio * kMinHeightRatio * longest2) return std::nullopt;
  return static_cast<std::size_t>(shortest - length2.begin());
}

/// Gives the ends of collapsed sides one position, so that triangles that were connected by such a triangle
/// remain connected. Poles whose vertices differ by rounding have such sides. Returns whether there were any.
bool close_collapsed_sides(TexturedMesh& mesh) {
  UnionFind positions(mesh.vertices.size());
  bool is_any = false;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (const auto k = collapsed_side(mesh, t)) {
      positions.unite(mesh.triangles[t][*k], mesh.triangles[t][(*k + 1) % 3]);
      is_any = true;
    }
  if (is_any)
    for (std::uint32_t v = 0; v < positions.size(); ++v)
      mesh.vertices[v] = Eigen::Vector3d(mesh.vertices[positions.root(v)]);
  return is_any;
}

bool has_area(const TexturedMesh& mesh, std::size_t t) {
  const auto& [a, b, c] = mesh.triangles[t];
  if (a == b || b == c || c == a) return false;
  double longest2 = 0;
  for (int k = 0; k < 3; ++k)
    longest2 = std::max(longest2, (mesh.corner(t, (k + 1) % 3) - mesh.corner(t, k)).squaredNorm());
  return 2 * mesh.area_vector(t).norm() > kMinHeightRatio * longest2;
}

/// Gives equal positions one vertex, and drops the vertices that no triangle uses. Returns how many became
/// one with another.
std::size_t weld_vertices(TexturedMesh& mesh) {
  std::vector<char> is_used(mesh.vertices.size(), 0);
  for (const Triangle& triangle : mesh.triangles)
    for (const auto v : triangle) is_used[v] = 1;
  std::vector<std::uint32_t> order;
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
    mesh.vertices[v] += Eigen::Vector3d::Zero();  // -0 becomes +0
    if (is_used[v]) order.push_back(v);
  }
  const auto key = [&](std::uint32_t v) {
    const Eigen::Vector3d& p = mesh.vertices[v];
    return std::array{p.x(), p.y(), p.z()};
  };
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    const auto ka = key(a);
    const auto kb = key(b);
    return ka != kb ? ka < kb : a < b;
  });
  std::vector<std::uint32_t> first_equal(mesh.vertices.size());
  std::size_t welded = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool is_equal = i > 0 && key(order[i]) == key(order[i - 1]);
    first_equal[order[i]] = is_equal ? first_equal[order[i - 1]] : order[i];
    welded += is_equal;
  }
  // Vertices keep the order of the file.
  std::vector<std::uint32_t> new_index(mesh.vertices.size());
  std::vector<Eigen::Vector3d> kept;
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
    if (!is_used[v]) continue;
    if (first_equal[v] == v) {
      new_index[v] = static_cast<std::uint32_t>(kept.size());
      kept.push_back(mesh.vertices[v]);
    }
    new_index[v] = new_index[first_equal[v]];
  }
  for (Triangle& triangle : mesh.triangles)
    for (auto& v : triangle) v = new_index[v];
  mesh.vertices = std::move(kept);
  return welded;
}

/// Gives vertices that differ by rounding the position of the first of them. Returns whether there were any.
bool close_gaps(TexturedMesh& mesh) {
  const auto [low, high] = bounds(mesh);
  const double distance = kWeldShare * (high - low).maxCoeff();
  if (!(distance > 0) || !std::isfinite(distance)) return false;
  UnionFind positions(mesh.vertices.size());
  bool is_any = false;
  NearVertices(mesh.vertices, distance).for_each_pair([&](std::uint32_t v, std::uint32_t w) {
    positions.unite(v, w);
    is_any = true;
  });
  if (is_any)
    for (std::uint32_t v = 0; v < positions.size(); ++v)
      mesh.vertices[v] = Eigen::Vector3d(mesh.vertices[positions.root(v)]);
  return is_any;
}

std::size_t drop_duplicates(TexturedMesh& mesh) {
  std::vector<std::pair<Triangle, std::uint32_t>> sorted;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    Triangle key = mesh.triangles[t];
    std::sort(key.begin(), key.end());
    sorted.emplace_back(key, t);
  }
  std::sort(sorted.begin(), sorted.end());
  std::vector<char> is_duplicate(mesh.triangles.size(), 0);
  for (std::size_t i = 1; i < sorted.size(); ++i)
    is_duplicate[sorted[i].second] = sorted[i].first == sorted[i - 1].first;
  return keep_triangles(mesh, [&](std::size_t t) { return !is_duplicate[t]; });
}

/// Two triangles are oriented alike if they pass their common edge in opposite directions.
bool are_oriented_alike(const std::vector<Triangle>& triangles, TriangleSide a, TriangleSide b) {
  return triangles[a.triangle][a.side] != triangles[b.triangle][b.side];
}

/// Orients each part of the surface that is connected by edges of two triangles: neighbors alike, as most of
/// the part already was. Edges where that is impossible (a Moebius strip has one) are cut.
class Orientation {
 public:
  Orientation(TexturedMesh& mesh, const EdgeTable& edges)
      : mesh_(mesh), partners_(mesh.triangle_count()), is_cut_(mesh.triangle_count(), 0) {
    for (auto& sides : partners_) sides.fill(kNoSide);
    for (const EdgeGroup& group : edges.groups)
      if (group.end - group.begin == 2) join(edges.sides[group.begin], edges.sides[group.begin + 1]);
  }

  /// Returns how many triangles it turned over.
  std::size_t orient() {
    std::size_t turned = 0;
    std::vector<char> state(mesh_.triangle_count(), kUnseen);
    for (std::uint32_t seed = 0; seed < state.size(); ++seed) {
      if (state[seed] != kUnseen) continue;
      std::vector<std::uint32_t> part = collect_part(seed, state);
      const auto turn_count = std::ranges::count_if(part, [&](std::uint32_t t) { return state[t] == kTurn; });
      const char turned_state = 2 * static_cast<std::size_t>(turn_count) > part.size() ? kKeep : kTurn;
      for (const auto t : part)
        if (state[t] == turned_state) {
          to_turn_.push_back(t);
          ++turned;
        }
    }
    cut_conflicts(state);
    for (const auto t : to_turn_) turn_with_partners(t);
    return turned;
  }

  std::size_t cut_count() const { return cut_count_; }
  /// Whether an edge of the triangle was cut: its part has one side only.
  bool is_cut(std::uint32_t t) const { return is_cut_[t] != 0; }
  /// By triangle and side: the side it is joined to.
  Neighbors& partners() { return partners_; }
  void turn_with_partners(std::uint32_t t) {
    turn_over(mesh_, t);  // sides 0, 1, 2 become 2, 1, 0
    std::swap(partners_[t][0], partners_[t][2]);
    for (std::uint8_t s = 0; s < 3; ++s) {
      const TriangleSide other = partners_[t][s];
      if (other != kNoSide) partners_[other.triangle][other.side] = {t, s};
    }
  }
  void join(TriangleSide a, TriangleSide b) {
    if (a.triangle == b.triangle) return;
    partners_[a.triangle][a.side] = b;
    partners_[b.triangle][b.side] = a;
  }

 private:
  static constexpr char kUnseen = 0;
  static constexpr char kKeep = 1;
  static constexpr char kTurn = 2;

  std::vector<std::uint32_t> collect_part(std::uint32_t seed, std::vector<char>& state) const {
    std::vector<std::uint32_t> part{seed};
    state[seed] = kKeep;
    for (std::size_t i = 0; i < part.size(); ++i)
      for (std::uint8_t s = 0; s < 3; ++s) {
        const TriangleSide other = partners_[part[i]][s];
        if (other == kNoSide || state[other.triangle] != kUnseen) continue;
        const bool is_alike = are_oriented_alike(mesh_.triangles, {part[i], s}, other);
        state[other.triangle] = is_alike == (state[part[i]] == kKeep) ? kKeep : kTurn;
        part.push_back(other.triangle);
      }
    return part;
  }

  void cut_conflicts(const std::vector<char>& state) {
    for (std::uint32_t t = 0; t < partners_.size(); ++t)
      for (std::uint8_t s = 0; s < 3; ++s) {
        const TriangleSide other = partners_[t][s];
        if (other == kNoSide) continue;
        const bool is_alike = are_oriented_alike(mesh_.triangles, {t, s}, other);
        if (is_alike == (state[t] == state[other.triangle])) continue;
        partners_[t][s] = partners_[other.triangle][other.side] = kNoSide;
        ++cut_count_;
        is_cut_[t] = is_cut_[other.triangle] = 1;
      }
  }

  TexturedMesh& mesh_;
  Neighbors partners_;
  std::vector<std::uint32_t> to_turn_;
  std::size_t cut_count_ = 0;
  std::vector<char> is_cut_;  ///< by triangle
};

/// A triangle side on an edge that more than two triangles share.
struct SideAround {
  TriangleSide side;
  double angle = 0;         ///< of the triangle, around the edge
  bool runs_along = false;  ///< from the edge's smaller vertex to the other
};

/// The sides on one edge, by their angle.

std::vector<SideAround> sort_around(const TexturedMesh& mesh, const EdgeTable& edges,
                                    const EdgeGroup& group) {
  const Eigen::Vector3d origin = mesh.vertices[group.from];
  const Eigen::Vector3d axis = (mesh.vertices[group.to] - origin).normalized();
  Eigen::Vector3d x = axis.unitOrthogonal();
  const Eigen::Vector3d y = axis.cross(x);
  std::vector<SideAround> around;
  for (std::uint32_t i = group.begin; i < group.end; ++i) {
    const TriangleSide s = edges.sides[i];
    const Eigen::Vector3d apex = mesh.corner(s.triangle, (s.side + 2) % 3) - origin;
    around.push_back(
        {s, std::atan2(apex.dot(y), apex.dot(x)), mesh.triangles[s.triangle][s.side] == group.from});
  }
  std::stable_sort(around.begin(), around.end(),
                   [](const SideAround& a, const SideAround& b) { return a.angle < b.angle; });
  return around;
}

/// Joins the triangles on edges with more than two of them in pairs that enclose a solid; returns how many
/// such edges there are.
std::size_t pair_up_crowded_edges(const TexturedMesh& mesh, const EdgeTable& edges,
                                  Orientation& orientation) {
  std::size_t crowded = 0;
  for (const EdgeGroup& group : edges.groups) {
    if (group.end - group.begin <= 2) continue;
    ++crowded;
    const auto around = sort_around(mesh, edges, group);
    const std::size_t n = around.size();
    std::vector<char> is_joined(n, 0);
    // The outside of a triangle that runs along the edge is towards growing angles, that of one that runs
    // against it towards falling angles. So the sector between one that runs against and a following one that
    // runs along is inside: the two enclose a solid.
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t next = (i + 1) % n;
      if (is_joined[i] || is_joined[next] || around[i].runs_along || !around[next].runs_along) continue;
      orientation.join(around[i].side, around[next].side);
      is_joined[i] = is_joined[next] = 1;
    }
  }
  return crowded;
}

/// A part of the surface: its triangles, the sides that no triangle joins, and the sum of its
/// triangles' area vectors times their heights over a point of it: three times its volume, if it is closed.
struct Part {
  std::vector<std::uint32_t> triangles;
  std::vector<TriangleSide> boundary;
  double volume = 0;
  double area = 0;
};

Part collect_part(const TexturedMesh& mesh, const Neighbors& partners, std::uint32_t seed,
                  std::vector<char>& is_seen) {
  Part part;
  is_seen[seed] = 1;
  part.triangles.push_back(seed);
  const Eigen::Vector3d& origin = mesh.corner(seed, 0);
  for (std::size_t i = 0; i < part.triangles.size(); ++i) {
    const std::uint32_t t = part.triangles[i];
    const Eigen::Vector3d area_vector = mesh.area_vector(t);
    part.volume += area_vector.dot(mesh.corner(t, 0) - origin);
    part.area += area_vector.norm();
    for (std::uint8_t s = 0; s < 3; ++s) {
      const TriangleSide other = partners[t][s];
      if (other == kNoSide) {
        part.boundary.push_back({t, s});
      } else if (!is_seen[other.triangle]) {
        is_seen[other.triangle] = 1;
        part.triangles.push_back(other.triangle);
      }
    }
  }
  return part;
}

/// The volume that fans of triangles around the centers of a part's holes add to it, and their size.
struct Filling {
  double volume = 0;
  double area = 0;           ///< as the holes' rims enclose it, ragged or not
  double fan_area = 0;       ///< of the triangles, which is much larger where a rim is not nearly flat
  double hidden_volume = 0;  ///< what the surface that is missing might enclose, at most
};

/// Sides that share vertices make one hole.
Filling fill_holes_of(const TexturedMesh& mesh, const Part& part) {
  std::map<std::uint32_t, std::uint32_t> number_of_vertex;
  for (const TriangleSide& side : part.boundary)
    for (std::size_t end = 0; end < 2; ++end)
      number_of_vertex.try_emplace(mesh.triangles[side.triangle][(side.side + end) % 3],
                                   static_cast<std::uint32_t>(number_of_vertex.size()));
  UnionFind holes(number_of_vertex.size());
  const auto ends_of = [&](const TriangleSide& side) {
    const Triangle& triangle = mesh.triangles[side.triangle];
    return std::array{triangle[side.side], triangle[(side.side + 1u) % 3]};
  };
  for (const TriangleSide& side : part.boundary) {
    const auto [from, to] = ends_of(side);
    holes.unite(number_of_vertex[from], number_of_vertex[to]);
  }
  std::vector<Eigen::Vector3d> center(holes.size(), Eigen::Vector3d::Zero());
  std::vector<double> count(holes.size(), 0);
  std::vector<Eigen::Vector3d> area(holes.size(), Eigen::Vector3d::Zero());
  for (const auto& [vertex, number] : number_of_vertex) {
    center[holes.root(number)] += mesh.vertices[vertex];
    ++count[holes.root(number)];
  }
  Filling filling;
  const Eigen::Vector3d& origin = mesh.corner(part.triangles[0], 0);
  for (const TriangleSide& side : part.boundary) {
    const auto [from, to] = ends_of(side);
    const std::uint32_t hole = holes.root(number_of_vertex[from]);
    const Eigen::Vector3d middle = center[hole] / count[hole];
    const Eigen::Vector3d& a = mesh.vertices[from];
    const Eigen::Vector3d& b = mesh.vertices[to];
    const Eigen::Vector3d area_vector = .5 * (a - b).cross(middle - b);
    filling.volume += area_vector.dot(b - origin);
    filling.fan_area += area_vector.norm();
    area[hole] += area_vector;
  }
  for (const Eigen::Vector3d& each : area) {
    filling.area += each.norm();
    filling.hidden_volume += std::pow(each.norm(), 1.5);  // a half sphere over the hole has .38 times that
  }
  return filling;
}

/// Closed parts are inside out if their volume is negative. So are almost closed ones (scans with holes), if
/// that is clear: a bowl or a sheet may well show its inside on purpose.
bool is_inside_out(const TexturedMesh& mesh, const Part& part) {
  if (part.boundary.empty()) return part.volume < 0;
  const Filling filling = fill_holes_of(mesh, part);
  if (filling.area > kMaxHoleShare * part.area || filling.fan_area > kMaxFanShare * part.area) return false;
  // Sums of area vector times height are three volumes.
  return part.volume + filling.volume < -3 * filling.hidden_volume;
}

struct Turned {
  std::size_t closed = 0;         ///< triangles of closed parts
  std::size_t almost_closed = 0;  ///< of parts with holes
};

Turned turn_parts_outwards(const TexturedMesh& mesh, Orientation& orientation) {
  Turned turned;
  std::vector<char> is_seen(mesh.triangle_count(), 0);
  for (std::uint32_t seed = 0; seed < is_seen.size(); ++seed) {
    if (is_seen[seed]) continue;
    const Part part = collect_part(mesh, orientation.partners(), seed, is_seen);
    const auto is_cut = [&](std::uint32_t t) { return orientation.is_cut(t); };
    if (std::ranges::any_of(part.triangles, is_cut) || !is_inside_out(mesh, part)) continue;
    for (const auto t : part.triangles) orientation.turn_with_partners(t);
    (part.boundary.empty() ? turned.closed : turned.almost_closed) += part.triangles.size();
  }
  return turned;
}

/// Gives every fan of triangles, connected around a vertex, a vertex of its own. Returns how many were added.
std::size_t split_vertices(TexturedMesh& mesh, const Neighbors& partners) {
  UnionFind fans(3 * mesh.triangle_count());
  for (std::uint32_t t = 0; t < partners.size(); ++t)
    for (std::uint32_t s = 0; s < 3; ++s) {
      const TriangleSide other = partners[t][s];
      if (other == kNoSide || other.triangle < t) continue;
      const std::uint32_t o = 3 * other.triangle;
      fans.unite(3 * t + s, o + (other.side + 1u) % 3);
      fans.unite(3 * t + (s + 1) % 3, o + other.side);
    }
  std::vector<char> is_taken(mesh.vertices.size(), 0);
  std::vector<std::uint32_t> vertex_of_root(fans.size());
  std::size_t added = 0;
  for (std::uint32_t c = 0; c < fans.size(); ++c) {
    std::uint32_t& v = mesh.triangles[c / 3][c % 3];
    const std::uint32_t root = fans.root(c);
    if (root == c) {
      vertex_of_root[c] = v;
      if (is_taken[v]) {
        vertex_of_root[c] = static_cast<std::uint32_t>(mesh.vertices.size());
        mesh.vertices.push_back(Eigen::Vector3d(mesh.vertices[v]));
        ++added;
      } else {
        is_taken[v] = 1;
      }
    }
    v = vertex_of_root[root];
  }
  return added;
}

}  // namespace

RepairedMesh repair_mesh(TexturedMesh mesh) {
  RepairedMesh result;
  const auto count = [&](const char* what, std::size_t n) {
    if (n > 0) result.repairs.push_back({what, n});
  };
  count("triangles without usable corners dropped",
        keep_triangles(mesh, [&](std::size_t t) { return has_usable_corners(mesh, t); }));
  std::size_t welded = weld_vertices(mesh);
  if (close_gaps(mesh)) welded += weld_vertices(mesh);
  if (close_collapsed_sides(mesh)) welded += weld_vertices(mesh);
  count("vertices welded", welded);
  count("degenerate triangles dropped",
        keep_triangles(mesh, [&](std::size_t t) { return has_area(mesh, t); }));
  count("duplicate triangles dropped", drop_duplicates(mesh));
  if (mesh.triangles.empty()) throw InputError("", "the model has no triangle with an area");
  weld_vertices(mesh);  // vertices of dropped triangles go

  const EdgeTable edges = edge_table(mesh.triangles);
  Orientation orientation(mesh, edges);
  const std::size_t turned = orientation.orient();
  count("edges cut where the surface has one side only", orientation.cut_count());
  // Turning triangles over renumbered their sides, so the edge table is built again.
  const std::size_t crowded = pair_up_crowded_edges(mesh, edge_table(mesh.triangles), orientation);
  const Turned outwards = turn_parts_outwards(mesh, orientation);
  count("triangles turned over", turned + outwards.closed);
  count("triangles of almost closed parts turned over, which were inside out", outwards.almost_closed);
  count("edges split where more than two triangles meet", crowded);
  std::size_t split = split_vertices(mesh, orientation.partners());
  // A cut may end inside the surface, where both its sides still have the same vertices. From here on
  // connection follows from the triangles alone, so it is found from them until nothing more is split.
  for (std::size_t added = split; added > 0; split += added)
    added = split_vertices(mesh, find_neighbors(mesh.triangles));
  count("vertices split where parts only touch", split);
  renumber_along_surface(mesh);
  result.mesh = std::move(mesh);
  return result;
}

}  // namespace hilbrush
