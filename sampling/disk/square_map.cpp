#include "sampling/disk/square_map.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "sampling/disk/convex_combination.h"
#include "sampling/disk/corners.h"
#include "sampling/disk/orientation.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Strips are mapped onto at most this many squares in a row.
constexpr double kMaxSquares = 64;
/// A map that lengthens the curve by more is made again with a sliding boundary.
constexpr double kMaxLengthening = 1.007;
/// At most this many parts that the map shrinks to nothing are slit open, one after the other.
constexpr int kMaxExtensions = 6;
/// Each slit must leave at most this share of the flipped faces.
constexpr double kMaxFlippedLeft = .8;
/// The general solver that mean values need is too slow beyond this.
constexpr std::size_t kMaxFacesForMeanValues = 20'000;

bool is_flipped(const Triangle& f, const std::vector<Vector2d>& places) {
  return orientation(places[f[0]], places[f[1]], places[f[2]]) <= 0;
}

/// How many squares in a row suit a strip with these sides, the first one running along the row.
int squares_for(const std::array<double, 4>& sides, double area) {
  const double length = .5 * (sides[0] + sides[2]), width = .5 * (sides[1] + sides[3]);
  // A boundary that is short against the area belongs to a blob, not to a strip.
  if (area > 2 * length * width) return 1;
  return static_cast<int>(std::lround(std::clamp(length / width, 1., kMaxSquares)));
}

double area_of(const Disk& disk, const Triangle& face) {
  const Vector3d& p = disk.positions()[face[0]];
  return .5 * (disk.positions()[face[1]] - p).cross(disk.positions()[face[2]] - p).norm();
}

double area_of(const Disk& disk) {
  double area = 0;
  for (const Triangle& face : disk.faces()) area += area_of(disk, face);
  return area;
}

/// Bits: a corner of the square lies on two sides.
constexpr std::uint8_t kBottom = 1, kRight = 2, kTop = 4, kLeft = 8, kAllSides = 15;

/// The boundary's places on the unit square, and which sides of the square a vertex lies on.
struct SquareBoundary {
  std::vector<Vector2d> places;
  std::vector<std::uint8_t> sides;

  std::vector<char> on_sides(std::uint8_t which) const {
    std::vector<char> is_on(sides.size());
    std::ranges::transform(sides, is_on.begin(),
                           [&](std::uint8_t s) { return static_cast<char>((s & which) != 0); });
    return is_on;
  }
};

/// Between corners by `measure`, see boundary_measure().
SquareBoundary place_boundary(const CutDisk& cut, const Corners& corners,
                              const std::vector<double>& measure) {
  const std::array<Vector2d, 4> square{Vector2d(0, 0), Vector2d(1, 0), Vector2d(1, 1), Vector2d(0, 1)};
  SquareBoundary boundary;
  boundary.places.assign(cut.disk.positions().size(), Vector2d(.5, .5));
  boundary.sides.assign(cut.disk.positions().size(), 0);
  const std::size_t n = cut.outer.size();
  for (std::size_t k = 0; k < 4; ++k) {
    const std::size_t begin = corners[k],
                      end = corners[(k + 1) % 4] + (corners[(k + 1) % 4] <= begin ? n : 0);
    const auto at = [&](std::size_t i) { return measure[i % n] + (i >= n ? measure.back() : 0); };
    const Vector2d& from = square[k];
    const Vector2d& to = square[(k + 1) % 4];
    for (std::size_t i = begin; i <= end; ++i) {
      const std::uint32_t v = cut.disk.from(cut.outer[i % n]);
      const double f = (at(i) - at(begin)) / (at(end) - at(begin));
      boundary.places[v] = i == end ? to : Vector2d(from + f * (to - from));
      boundary.sides[v] |= static_cast<std::uint8_t>(1u << k);
    }
  }
  return boundary;
}

/// An inner edge between two vertices on one side of the square would be mapped onto that side, with all that
/// it cuts off.
void split_chords(Disk& disk, SquareBoundary& boundary) {
  // The loop also visits the faces that splitting adds: they take over sides of the old ones.
  for (std::uint32_t f = 0; f < disk.faces().size(); ++f)
    for (std::uint8_t s = 0; s < 3; ++s) {
      const TriangleSide side{f, s};
      if (disk.neighbors()[f][s] == kNoSide ||
          (boundary.sides[disk.from(side)] & boundary.sides[disk.to(side)]) == 0)
        continue;
      disk.split_edge(side);
      boundary.places.emplace_back(.5, .5);
      boundary.sides.push_back(0);
    }
}

/// Squared stretches of the map of a face, from the surface to the square, larger one first.
std::array<double, 2> squared_stretches(const Disk& disk, const Triangle& face,
                                        const std::vector<Vector2d>& places) {
  const Vector3d p = disk.positions()[face[1]] - disk.positions()[face[0]];
  const Vector3d q = disk.positions()[face[2]] - disk.positions()[face[0]];
  const double height = p.cross(q).norm() / p.norm();
  // In axes of its plane, the first along p.
  const Vector2d dx = (places[face[1]] - places[face[0]]) / p.norm();
  const Vector2d dy = (places[face[2]] - places[face[0]] - dx * (p.dot(q) / p.norm())) / height;
  const double mean = .5 * (dx.squaredNorm() + dy.squaredNorm());
  const double spread = std::hypot(.5 * (dx.squaredNorm() - dy.squaredNorm()), dx.dot(dy));
  return {mean + spread, std::max(0., mean - spread)};
}

struct Shear {
  double ratio = 1, lengthening = 1;
};

/// Means weighted by the area of the surface; no face counts for more than kMax.
Shear mean_shear(const Disk& disk, const std::vector<Vector2d>& places) {
  constexpr double kMax = 1e3;
  Shear sum{0, 0};
  double area = 0;
  for (std::size_t f = 0; f < disk.faces().size(); ++f) {
    if (disk.sources()[f].triangle == kNoTriangle) continue;
    const Triangle& face = disk.faces()[f];
    const double face_area = area_of(disk, face);
    if (!(face_area > 0)) continue;
    const auto [large, small] = squared_stretches(disk, face, places);
    const double ratio = small * kMax * kMax > large ? std::sqrt(large / small) : kMax;
    sum.ratio += face_area * ratio;
    sum.lengthening += face_area * .5 * (std::sqrt(ratio) + 1 / std::sqrt(ratio));
    area += face_area;
  }
  return area > 0 ? Shear{sum.ratio / area, sum.lengthening / area} : Shear{};
}

double energy(const WeightedGraph& graph, const Eigen::VectorXd& values) {
  double sum = 0;
  for (std::uint32_t v = 0; v < graph.vertex_count(); ++v)
    for (auto a = graph.begin[v]; a < graph.begin[v + 1]; ++a)
      sum += .5 * graph.weight[a] * std::pow(values[v] - values[graph.to[a]], 2);
  return sum;
}

/// Rows of (x, y) on the unit square, stretched to a row of squares, and turned by a right angle if it stands
/// upright.
std::vector<Vector2d> places_of(const Eigen::MatrixXd& values, double width, bool is_upright) {
  std::vector<Vector2d> places(static_cast<std::size_t>(values.rows()));
  for (Eigen::Index v = 0; v < values.rows(); ++v)
    places[static_cast<std::size_t>(v)] = is_upright ? Vector2d(width * values(v, 1), 1 - values(v, 0))
                                                     : Vector2d(width * values(v, 0), values(v, 1));
  return places;
}

/// The maps that can be made of one cut disk, and the best of those that are valid.
struct MapTrial {
  std::optional<SquareMap> best;
  std::vector<std::uint32_t> flipped;  ///< vertices of the flipped faces of the last map that had any

  explicit MapTrial(CutDisk& c) : cut_(c), along_(lengths_along(cut_)) {
    set_corners(choose_corners(cut_, along_));
  }

  void fix_boundary() {
    Eigen::MatrixXd values = boundary_places_;
    if (!solve_symmetric(graph_, order_, boundary_.on_sides(kAllSides), values)) return;
    modulus_ = modulus_of(values);
    take(places_of(values, square_count_, false), square_count_);
  }

  /// Moves corners so that a slit becomes a whole number of squares, by what the map with a fixed boundary
  /// says.
  void fit_corners() {
    if (const auto corners = corners_for_whole_squares(cut_, along_, modulus_)) set_corners(*corners);
  }

  void slide_boundary() {
    Eigen::MatrixXd values = boundary_places_;
    if (!solve_symmetric(graph_, order_, boundary_.on_sides(kLeft | kRight), values.col(0)) ||
        !solve_symmetric(graph_, order_, boundary_.on_sides(kBottom | kTop), values.col(1)))
      return;
    const double width = modulus_of(values);
    const int count = static_cast<int>(std::lround(std::clamp(std::max(width, 1 / width), 1., kMaxSquares)));
    take(places_of(values, count, width < 1), count);
  }

  void use_mean_values() {
    Eigen::MatrixXd values = boundary_places_;
    if (solve_general(mean_value_graph(cut_.disk), boundary_.on_sides(kAllSides), values))
      take(places_of(values, square_count_, false), square_count_);
  }

 private:
  void set_corners(const Corners& corners) {
    boundary_ = place_boundary(cut_, corners, boundary_measure(cut_, along_));
    const bool has_corners = !cut_.is_cut || cut_.forks.size() >= 4;
    square_count_ = has_corners ? squares_for(side_lengths(corners, along_), area_of(cut_.disk)) : 1;
    const std::uint32_t start = cut_.disk.from(cut_.outer.front());
    split_chords(cut_.disk, boundary_);
    cut_.outer = loop_from(cut_.disk, start);  // splitting has moved sides about
    graph_ = cotan_graph(cut_.disk);
    order_ = elimination_order(graph_);
    boundary_places_.resize(static_cast<Eigen::Index>(boundary_.places.size()), 2);
    for (std::size_t v = 0; v < boundary_.places.size(); ++v)
      boundary_places_.row(static_cast<Eigen::Index>(v)) = boundary_.places[v];
  }

  /// Width over height of the rectangle that suits the map best.
  double modulus_of(const Eigen::MatrixXd& values) const {
    return std::sqrt(energy(graph_, values.col(1)) / energy(graph_, values.col(0)));
  }

  void take(std::vector<Vector2d> places, int count) {
    if (count_flipped(cut_.disk, places) > 0) {
      flipped.clear();
      for (const Triangle& face : cut_.disk.faces())
        if (is_flipped(face, places)) flipped.insert(flipped.end(), face.begin(), face.end());
      return;
    }
    const Shear shear = mean_shear(cut_.disk, places);
    if (!best || shear.lengthening < best->lengthening)
      best = SquareMap{std::move(places), count, shear.ratio, shear.lengthening};
  }

  CutDisk& cut_;
  std::vector<double> along_;
  SquareBoundary boundary_;
  WeightedGraph graph_;
  std::vector<std::uint32_t> order_;
  Eigen::MatrixXd boundary_places_;  ///< a row a vertex
  int square_count_ = 1;             ///< with the boundary fixed
  double modulus_ = 1;               ///< by the map with the boundary fixed
};

}  // namespace

std::size_t count_flipped(const Disk& disk, const std::vector<Vector2d>& places) {
  return static_cast<std::size_t>(
      std::ranges::count_if(disk.faces(), [&](const Triangle& face) { return is_flipped(face, places); }));
}

std::optional<SquareMap> map_to_square(CutDisk& cut) {
  std::size_t most_flipped = std::numeric_limits<std::size_t>::max();
  for (int extensions = 0;; ++extensions) {
    if (cut.outer.size() < 4) return std::nullopt;
    MapTrial trial(cut);
    trial.fix_boundary();
    if (trial.best && trial.best->lengthening <= kMaxLengthening) return trial.best;
    trial.fit_corners();
    trial.slide_boundary();
    if (trial.best) return trial.best;
    // Flipped faces: there the map has shrunk a part to nothing, and its places differ in their last digits
    // only.
    const bool is_better = trial.flipped.size() < most_flipped;
    most_flipped = static_cast<std::size_t>(kMaxFlippedLeft * static_cast<double>(trial.flipped.size()));
    if (is_better && extensions < kMaxExtensions && extend_cut(cut, trial.flipped)) continue;
    if (cut.disk.faces().size() <= kMaxFacesForMeanValues) trial.use_mean_values();
    return trial.best;
  }
}

}  // namespace hilbrush
