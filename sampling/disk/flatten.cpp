#include "sampling/disk/flatten.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "sampling/disk/cut_to_disk.h"
#include "sampling/disk/shortest_paths.h"
#include "sampling/disk/square_map.h"

namespace hilbrush {
namespace {

/// A component is halved at most this many times in a row, and no piece with fewer triangles is halved.
constexpr int kMaxDivisions = 8;
constexpr std::size_t kMinTrianglesToDivide = 40;

std::array<Eigen::Vector3d, 4> corner_positions(const CutDisk& cut, const SquareMap& map) {
  const double width = map.square_count;
  const std::array<Eigen::Vector2d, 4> corners{Eigen::Vector2d(0, 0), Eigen::Vector2d(width, 0),
                                               Eigen::Vector2d(width, 1), Eigen::Vector2d(0, 1)};
  std::array<Eigen::Vector3d, 4> positions;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto distance2 = [&](TriangleSide s) {
      return (map.places[cut.disk.from(s)] - corners[k]).squaredNorm();
    };
    positions[k] = cut.disk.positions()[cut.disk.from(*std::ranges::min_element(cut.outer, {}, distance2))];
  }
  return positions;
}

FlatPiece make_piece(const CutDisk& cut, const SquareMap& map) {
  FlatPiece piece;
  piece.square_count = map.square_count;
  piece.corners_O = corner_positions(cut, map);
  piece.faces.reserve(cut.disk.faces().size());
  for (std::size_t f = 0; f < cut.disk.faces().size(); ++f) {
    const FaceSource& source = cut.disk.sources()[f];
    if (source.triangle == kNoTriangle) continue;
    const Triangle& face = cut.disk.faces()[f];
    piece.faces.push_back(
        {source.triangle, {map.places[face[0]], map.places[face[1]], map.places[face[2]]}, source.corners});
  }
  return piece;
}

/// The two halves of a component: the triangles nearer to one of two far ends, along paths over triangles'
/// centers.
std::array<std::vector<std::uint32_t>, 2> halves(const TexturedMesh& mesh, const Neighbors& neighbors,
                                                 const std::vector<std::uint32_t>& triangles) {
  const auto n = static_cast<std::uint32_t>(triangles.size());
  const auto local = [&](std::uint32_t t) {
    const auto at = std::lower_bound(triangles.begin(), triangles.end(), t);
    return at != triangles.end() && *at == t ? static_cast<std::uint32_t>(at - triangles.begin()) : n;
  };
  const auto center = [&](std::uint32_t i) {
    return Eigen::Vector3d(
        (mesh.corner(triangles[i], 0) + mesh.corner(triangles[i], 1) + mesh.corner(triangles[i], 2)) / 3);
  };
  struct Paths {
    std::vector<double> lengths;
    std::vector<std::uint32_t> sources;  ///< where the path to a triangle begins
  };
  const auto paths_from = [&](const std::vector<std::uint32_t>& sources) {
    Paths paths{{}, std::vector<std::uint32_t>(n, n)};
    for (const std::uint32_t s : sources) paths.sources[s] = s;
    paths.lengths = shortest_distances(n, sources, [&](std::uint32_t i, auto reach) {
      for (const TriangleSide other : neighbors[triangles[i]]) {
        const std::uint32_t j = other == kNoSide ? n : local(other.triangle);
        if (j != n && reach(j, (center(j) - center(i)).norm())) paths.sources[j] = paths.sources[i];
      }
    });
    return paths;
  };
  const auto farthest = [&](std::uint32_t from) {
    const std::vector<double> lengths = paths_from({from}).lengths;
    return static_cast<std::uint32_t>(std::ranges::max_element(lengths) - lengths.begin());
  };
  const std::uint32_t one_end = farthest(0);
  const std::uint32_t other_end = farthest(one_end);
  const Paths paths = paths_from({one_end, other_end});
  std::array<std::vector<std::uint32_t>, 2> result;
  for (std::uint32_t i = 0; i < n; ++i) result[paths.sources[i] == one_end ? 0 : 1].push_back(triangles[i]);
  return result;
}

class Flattening {
 public:
  Flattening(const TexturedMesh& mesh, const Neighbors& neighbors, double area_share, double area_m2)
      : mesh_(mesh), neighbors_(neighbors), share_per_m2_(area_m2 > 0 ? area_share / area_m2 : 0) {}

  FlatComponent run(const Component& component) {
    add(component, kMaxDivisions);
    if (area_ > 0) result_.shear = sheared_ / area_;
    if (result_.pieces.size() > 1)
      result_.reason = "divided into " + std::to_string(result_.pieces.size()) + " pieces: " + result_.reason;
    return std::move(result_);
  }

 private:
  void add(const Component& component, int divisions) {
    if (add_whole(component)) return;
    if (component.genus < 0 || divisions == 0 || component.triangles.size() < kMinTrianglesToDivide)
      return add_in_space(component);
    const auto two_halves = halves(mesh_, neighbors_, component.triangles);
    // Where all triangles' centers fall onto one point there are no far ends.
    if (two_halves[0].empty() || two_halves[1].empty()) return add_in_space(component);
    is_divided_ = true;
    for (const auto& triangles : two_halves)
      add(describe_component(mesh_, neighbors_, triangles), divisions - 1);
  }

  void add_in_space(const Component& component) {
    FlatPiece piece;
    piece.triangles_in_space = component.triangles;
    piece.corners_O = box_corners(mesh_, component.triangles);
    result_.pieces.push_back(std::move(piece));
  }

  bool add_whole(const Component& component) {
    CutOptions options;
    options.area_share = share_per_m2_ * component.area_m2;
    const bool has_holes = component.boundary_loops > 1;
    for (int attempt = 0; attempt < (has_holes ? 2 : 1); ++attempt) {
      if (attempt == 1) options.max_holes = 0;
      auto cut = cut_to_disk(mesh_, neighbors_, component, options);
      if (!cut) {
        result_.reason = cut.reason();
        return false;
      }
      const auto map = map_to_square(*cut);
      if (map) {
        result_.pieces.push_back(make_piece(*cut, *map));
        if (!is_divided_) result_.reason.clear();
        result_.cut_length_m += cut->cut_length_m;
        sheared_ += map->shear * component.area_m2;
        area_ += component.area_m2;
        return true;
      }
      result_.reason = "no map of it onto the square without a flipped triangle was found";
    }
    return false;
  }

  const TexturedMesh& mesh_;
  const Neighbors& neighbors_;
  double share_per_m2_;
  double sheared_ = 0, area_ = 0;
  bool is_divided_ = false;
  FlatComponent result_;
};

}  // namespace

std::array<Eigen::Vector3d, 4> box_corners(const TexturedMesh& mesh,
                                           const std::vector<std::uint32_t>& triangles) {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  const auto for_each_vertex = [&](auto visit) {
    for (const auto t : triangles)
      for (int c = 0; c < 3; ++c) visit(mesh.corner(t, c));
  };
  for_each_vertex([&](const Eigen::Vector3d& p) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  });
  const std::array<Eigen::Vector3d, 4> box{low, Eigen::Vector3d(high.x(), low.y(), low.z()),
                                           Eigen::Vector3d(high.x(), high.y(), low.z()),
                                           Eigen::Vector3d(low.x(), high.y(), low.z())};
  std::array<Eigen::Vector3d, 4> nearest;
  nearest.fill(mesh.corner(triangles.front(), 0));
  for_each_vertex([&](const Eigen::Vector3d& p) {
    for (std::size_t k = 0; k < 4; ++k)
      if ((p - box[k]).squaredNorm() < (nearest[k] - box[k]).squaredNorm()) nearest[k] = p;
  });
  return nearest;
}

FlatComponent flatten(const TexturedMesh& mesh, const Neighbors& neighbors, const Component& component,
                      double area_share) {
  return Flattening(mesh, neighbors, area_share, component.area_m2).run(component);
}

}  // namespace hilbrush
