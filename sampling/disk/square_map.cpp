#include "sampling/disk/square_map.h"

// clang-format off
#include <iostream>  // Eigen/MetisSupport prints, but does not say so
#include <Eigen/MetisSupport>
// clang-format on

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseLU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "sampling/check.h"
#include "sampling/disk/orientation.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Sparse = Eigen::SparseMatrix<double>;

constexpr double kLeastWeight = 1e-2, kMostWeight = 1e3;
/// Below this METIS has nothing to gain.
constexpr Eigen::Index kSmallSystem = 2000;
/// A boundary vertex that turns by more is a corner of the shape itself.
constexpr double kShapeCornerTurn = std::numbers::pi / 4;
constexpr double kLeastSideShare = .005;
/// Strips are mapped onto at most so many squares in a row.
constexpr int kMostSquares = 64;
/// Of more forks than these only the ones nearest to the quarters of the boundary are tried as corners.
constexpr std::size_t kMostForks = 16;

double angle(const Vector3d& a, const Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

double angle_at(const Disk& disk, std::uint32_t face, std::size_t corner) {
  const Triangle& f = disk.faces()[face];
  const Vector3d& p = disk.positions()[f[corner]];
  return angle(disk.positions()[f[(corner + 1) % 3]] - p, disk.positions()[f[(corner + 2) % 3]] - p);
}

/// Where along the outer loop the four corners of the square go, as indices of its sides, rising.
using Corners = std::array<std::size_t, 4>;

/// Length along the loop before each side, and all of it at the end.
std::vector<double> lengths_along(const CutDisk& cut) {
  std::vector<double> along{0};
  for (const TriangleSide s : cut.outer) along.push_back(along.back() + cut.disk.length(s));
  return along;
}

std::array<double, 4> side_lengths(const Corners& corners, const std::vector<double>& along) {
  std::array<double, 4> sides{};
  for (std::size_t k = 0; k < 3; ++k) sides[k] = along[corners[k + 1]] - along[corners[k]];
  sides[3] = along.back() - along[corners[3]] + along[corners[0]];
  return sides;
}

/// Adds the place nearest to the middle of the longest stretch between two corners.
void add_middle_of_longest(std::vector<std::size_t>& corners, const std::vector<double>& along) {
  const std::size_t n = along.size() - 1;
  const auto at = [&](std::size_t i) { return along[i % n] + (i >= n ? along.back() : 0); };
  const auto end_of = [&](std::size_t k) { return k + 1 < corners.size() ? corners[k + 1] : corners[0] + n; };
  std::size_t longest = 0;
  for (std::size_t k = 1; k < corners.size(); ++k)
    if (at(end_of(k)) - at(corners[k]) > at(end_of(longest)) - at(corners[longest])) longest = k;
  const double middle = .5 * (at(corners[longest]) + at(end_of(longest)));
  std::size_t best = corners[longest] + 1;
  for (std::size_t i = best; i < end_of(longest); ++i)
    if (std::abs(at(i) - middle) < std::abs(at(best) - middle)) best = i;
  corners.push_back(best % n);
  std::sort(corners.begin(), corners.end());
}

/// The shape's own corners, sharpest first; a shape with fewer than four gets the others in the middle of its longest
/// sides.
std::optional<Corners> corners_of_shape(const CutDisk& cut, const std::vector<double>& along) {
  std::vector<double> turn(cut.disk.positions().size(), std::numbers::pi);
  for (std::uint32_t f = 0; f < cut.disk.faces().size(); ++f)
    for (std::size_t c = 0; c < 3; ++c) turn[cut.disk.faces()[f][c]] -= angle_at(cut.disk, f, c);
  const auto turn_at = [&](std::size_t i) { return turn[cut.disk.from(cut.outer[i])]; };
  std::vector<std::size_t> sharp;
  for (std::size_t i = 0; i < cut.outer.size(); ++i)
    if (turn_at(i) >= kShapeCornerTurn) sharp.push_back(i);
  if (sharp.empty()) return std::nullopt;
  std::stable_sort(sharp.begin(), sharp.end(),
                   [&](std::size_t a, std::size_t b) { return turn_at(a) > turn_at(b) + 1e-9; });
  if (sharp.size() > 4) sharp.resize(4);
  std::sort(sharp.begin(), sharp.end());
  while (sharp.size() < 4) add_middle_of_longest(sharp, along);
  const Corners corners{sharp[0], sharp[1], sharp[2], sharp[3]};
  const auto sides = side_lengths(corners, along);
  if (*std::min_element(sides.begin(), sides.end()) < kLeastSideShare * along.back()) return std::nullopt;
  return corners;
}

Corners corners_by_length(const std::vector<double>& along) {
  const std::size_t n = along.size() - 1;
  Corners corners{};
  for (std::size_t k = 0; k < 4; ++k) {
    const double wanted = (static_cast<double>(k) + .5) / 4 * along.back();
    const auto above = static_cast<std::size_t>(std::lower_bound(along.begin(), along.end(), wanted) - along.begin());
    const std::size_t nearest = above > 0 && wanted - along[above - 1] < along[above] - wanted ? above - 1 : above;
    corners[k] = std::min(std::max(nearest, k == 0 ? 0 : corners[k - 1] + 1), n - 4 + k);
  }
  return corners;
}

/// Four of the forks so that opposite sides are alike and none is short.
std::optional<Corners> corners_at_forks(const CutDisk& cut, const std::vector<double>& along) {
  std::vector<std::size_t> forks;
  for (std::size_t i = 0; i < cut.outer.size(); ++i)
    if (std::ranges::find(cut.forks, cut.disk.from(cut.outer[i])) != cut.forks.end()) forks.push_back(i);
  if (forks.size() < 4 || forks.size() > kMostForks) return std::nullopt;
  std::optional<Corners> best;
  double best_score = std::numeric_limits<double>::infinity();
  const std::size_t n = forks.size();
  for (std::size_t a = 0; a + 3 < n; ++a)
    for (std::size_t b = a + 1; b + 2 < n; ++b)
      for (std::size_t c = b + 1; c + 1 < n; ++c)
        for (std::size_t d = c + 1; d < n; ++d) {
          const Corners corners{forks[a], forks[b], forks[c], forks[d]};
          const auto sides = side_lengths(corners, along);
          const double shortest = *std::min_element(sides.begin(), sides.end());
          const double score = std::abs(sides[0] - sides[2]) + std::abs(sides[1] - sides[3]) - .1 * shortest;
          if (shortest > kLeastSideShare * along.back() && score < best_score) best = corners, best_score = score;
        }
  return best;
}

/// How many squares in a row suit a strip with these sides, the first one running along the row.
int squares_for(const std::array<double, 4>& sides, double area) {
  const double length = .5 * (sides[0] + sides[2]), width = .5 * (sides[1] + sides[3]);
  // A boundary that is short against the area belongs to a blob, not to a strip.
  if (area > 2 * length * width) return 1;
  return std::clamp(static_cast<int>(std::lround(length / width)), 1, kMostSquares);
}

double area_of(const Disk& disk) {
  double area = 0;
  for (const Triangle& f : disk.faces()) {
    const Vector3d& p = disk.positions()[f[0]];
    area += .5 * (disk.positions()[f[1]] - p).cross(disk.positions()[f[2]] - p).norm();
  }
  return area;
}

/// The boundary's places on the square, and which sides of the square a vertex lies on (bits; corners have two).
struct SquareBoundary {
  SquareMap map;
  std::vector<std::uint8_t> sides;
  std::vector<char> is_boundary;
};

struct SquareCorners {
  Corners corners;
  int square_count = 1;
};

SquareCorners choose_corners(const CutDisk& cut, const std::vector<double>& along) {
  const auto natural = cut.is_cut ? corners_at_forks(cut, along) : corners_of_shape(cut, along);
  if (!natural) return {corners_by_length(along), 1};
  const Corners& c = *natural;
  const auto s = side_lengths(c, along);
  const double area = area_of(cut.disk);
  if (s[0] + s[2] >= s[1] + s[3]) return {c, squares_for(s, area)};
  return {{c[1], c[2], c[3], c[0]}, squares_for({s[1], s[2], s[3], s[0]}, area)};
}

SquareBoundary place_boundary(const CutDisk& cut) {
  const std::vector<double> along = lengths_along(cut);
  const auto [corners, square_count] = choose_corners(cut, along);
  const double width = square_count;
  const std::array<Vector2d, 4> square{Vector2d(0, 0), Vector2d(width, 0), Vector2d(width, 1), Vector2d(0, 1)};

  SquareBoundary boundary;
  boundary.map.square_count = square_count;
  boundary.map.places.assign(cut.disk.positions().size(), Vector2d(.5 * width, .5));
  boundary.sides.assign(cut.disk.positions().size(), 0);
  boundary.is_boundary.assign(cut.disk.positions().size(), 0);
  const std::size_t n = cut.outer.size();
  for (std::size_t k = 0; k < 4; ++k) {
    const std::size_t begin = corners[k], end = corners[(k + 1) % 4] + (corners[(k + 1) % 4] <= begin ? n : 0);
    const auto at = [&](std::size_t i) { return along[i % n] + (i >= n ? along.back() : 0); };
    const Vector2d& from = square[k];
    const Vector2d& to = square[(k + 1) % 4];
    for (std::size_t i = begin; i <= end; ++i) {
      const std::uint32_t v = cut.disk.from(cut.outer[i % n]);
      const double f = (at(i) - at(begin)) / (at(end) - at(begin));
      boundary.map.places[v] = i == end ? to : Vector2d(from + f * (to - from));
      boundary.sides[v] |= static_cast<std::uint8_t>(1u << k);
      boundary.is_boundary[v] = 1;
    }
  }
  return boundary;
}

/// An inner edge between two vertices on one side of the square would be mapped onto that side, with all that it cuts
/// off.
void split_chords(Disk& disk, SquareBoundary& boundary) {
  // The faces that splitting adds are looked at in their turn: they take over sides of the old ones.
  for (std::uint32_t f = 0; f < disk.faces().size(); ++f)
    for (std::uint8_t s = 0; s < 3; ++s) {
      const TriangleSide side{f, s};
      if (disk.neighbours()[f][s] == kNoSide || (boundary.sides[disk.from(side)] & boundary.sides[disk.to(side)]) == 0)
        continue;
      disk.split_edge(side);
      boundary.map.places.emplace_back(.5, .5);
      boundary.sides.push_back(0);
      boundary.is_boundary.push_back(0);
    }
}

/// Weight of the arc from a vertex to the next corner of a face, the half that this face gives.
using HalfWeight = double (*)(const Disk& disk, std::uint32_t face, std::size_t from, std::size_t to);

double cotan_half(const Disk& disk, std::uint32_t face, std::size_t from, std::size_t to) {
  const std::size_t apex = 3 - from - to;
  const double tangent = std::tan(angle_at(disk, face, apex));
  const double cotan = std::abs(tangent) < 1e-9 ? std::copysign(1e9, tangent) : 1 / tangent;
  return std::clamp(cotan, kLeastWeight, kMostWeight);
}

double mean_value_half(const Disk& disk, std::uint32_t face, std::size_t from, std::size_t to) {
  const Triangle& f = disk.faces()[face];
  const double length = (disk.positions()[f[to]] - disk.positions()[f[from]]).norm();
  const double weight = length > 0 ? std::tan(angle_at(disk, face, from) / 2) / length : 0;
  return std::max(weight, 1e-12);
}

/// The linear system for the inner vertices: every one is the weighted mean of its neighbours.
struct MapSystem {
  Sparse matrix;
  Eigen::MatrixX2d right;
  std::vector<std::uint32_t> inner;  ///< the vertices
};

MapSystem assemble(const Disk& disk, const SquareBoundary& boundary, HalfWeight half) {
  MapSystem system;
  std::vector<int> index(boundary.map.places.size(), -1);
  for (std::uint32_t v = 0; v < index.size(); ++v)
    if (!boundary.is_boundary[v]) {
      index[v] = static_cast<int>(system.inner.size());
      system.inner.push_back(v);
    }
  const auto n = static_cast<Eigen::Index>(system.inner.size());
  system.right = Eigen::MatrixX2d::Zero(n, 2);
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(12 * disk.faces().size());
  const auto add = [&](std::uint32_t v, std::uint32_t w, double weight) {
    if (index[v] < 0) return;
    entries.emplace_back(index[v], index[v], weight);
    if (index[w] >= 0)
      entries.emplace_back(index[v], index[w], -weight);
    else
      system.right.row(index[v]) += weight * boundary.map.places[w].transpose();
  };
  for (std::uint32_t f = 0; f < disk.faces().size(); ++f)
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t d = (c + 1) % 3;
      add(disk.faces()[f][c], disk.faces()[f][d], half(disk, f, c, d));
      add(disk.faces()[f][d], disk.faces()[f][c], half(disk, f, d, c));
    }
  system.matrix.resize(n, n);
  system.matrix.setFromTriplets(entries.begin(), entries.end());
  return system;
}

template <class Solver>
bool solve_with(Solver&& solver, const MapSystem& system, std::vector<Vector2d>& map) {
  solver.compute(system.matrix);
  if (solver.info() != Eigen::Success) return false;
  const Eigen::MatrixX2d places = solver.solve(system.right);
  if (!places.allFinite()) return false;
  for (std::size_t i = 0; i < system.inner.size(); ++i) map[system.inner[i]] = places.row(static_cast<Eigen::Index>(i));
  return true;
}

bool solve_symmetric(const MapSystem& system, std::vector<Vector2d>& map) {
  if (system.matrix.rows() == 0) return true;
  if (system.matrix.rows() < kSmallSystem)
    return solve_with(Eigen::SimplicialLDLT<Sparse, Eigen::Lower, Eigen::AMDOrdering<int>>(), system, map);
  return solve_with(Eigen::SimplicialLDLT<Sparse, Eigen::Lower, Eigen::MetisOrdering<int>>(), system, map);
}

bool solve_general(const MapSystem& system, std::vector<Vector2d>& map) {
  if (system.matrix.rows() == 0) return true;
  return solve_with(Eigen::SparseLU<Sparse, Eigen::COLAMDOrdering<int>>(), system, map);
}

}  // namespace

std::size_t count_flipped(const Disk& disk, const std::vector<Vector2d>& places) {
  return static_cast<std::size_t>(std::ranges::count_if(
      disk.faces(), [&](const Triangle& f) { return orientation(places[f[0]], places[f[1]], places[f[2]]) <= 0; }));
}

std::optional<SquareMap> map_to_square(CutDisk& cut) {
  if (cut.outer.size() < 4) return std::nullopt;
  SquareBoundary boundary = place_boundary(cut);
  split_chords(cut.disk, boundary);
  SquareMap map = boundary.map;
  const auto is_valid = [&] { return count_flipped(cut.disk, map.places) == 0; };
  if (solve_symmetric(assemble(cut.disk, boundary, cotan_half), map.places) && is_valid()) return map;
  map.places = boundary.map.places;
  if (solve_general(assemble(cut.disk, boundary, mean_value_half), map.places) && is_valid()) return map;
  return std::nullopt;
}

}  // namespace hilbrush
