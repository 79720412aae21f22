#include "sampling/gaps/fill_holes.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>

#include "sampling/base/input_error.h"
#include "sampling/curve/chart.h"
#include "sampling/curve/dot_triangle.h"
#include "sampling/curve/project_to_surface.h"
#include "sampling/gaps/dot_path.h"
#include "sampling/gaps/gap_meter.h"
#include "sampling/gaps/square_places.h"
#include "sampling/gaps/voronoi_places.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// In pitches. A hexagonal grid of dots has gaps of .62.
constexpr double kMinGapPitches = .5;
/// Circles are filled from this share below the limit, because the sweep stops halving pieces at that size
/// (kFinestPiece in gap_meter.cpp): it then finds little that is left.
constexpr double kMargin = .03;
/// Voronoi diagrams at most; the sweep fills the rest.
constexpr int kMaxRounds = 3;
/// Steps of the walk from a dot to the middle of a hole at most; each crosses about a dozen triangles.
constexpr int kMaxWalks = 16;
/// In radii of a hole: dots this near to its middle are where the new dot may be inserted into the path.
constexpr double kNeighborhoodRadii = 1.6;
/// Cells of the grid of dots.
constexpr double kCellPitches = 2;
/// Blocks of triangles in the sweep: fixed, so that the number of threads does not matter.
constexpr std::size_t kBlocks = 256;

/// Center of the circle through three points in space; none if they lie in line.
std::optional<Vector3d> circle_center(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const Vector3d u = b - a;
  const Vector3d v = c - a;
  const Vector3d n = u.cross(v);
  if (n.squaredNorm() <= 1e-12 * u.squaredNorm() * v.squaredNorm()) return {};
  return a + (u.squaredNorm() * v.cross(n) + v.squaredNorm() * n.cross(u)) / (2 * n.squaredNorm());
}

SurfacePoint point_of(const TexturedMesh& mesh, const Dot& dot) {
  const Vector3d& a = mesh.corner(dot.triangle, 0);
  const Vector3d n = 2 * mesh.area_vector(dot.triangle);
  const Vector3d u = mesh.corner(dot.triangle, 1) - a;
  const Vector3d v = mesh.corner(dot.triangle, 2) - a;
  const Vector3d w = dot.position_O - a;
  const double f = w.cross(v).dot(n) / n.squaredNorm();
  const double g = u.cross(w).dot(n) / n.squaredNorm();
  return {dot.triangle, {1 - f - g, f, g}};
}

double darkest_at(const ToneField& tone, const TexturedMesh& mesh, const std::vector<Dot>& dots) {
  double darkest = 1e-6;
  for (const Dot& dot : dots) darkest = std::max(darkest, tone.asked(point_of(mesh, dot)));
  return darkest;
}

class HoleFilling {
 public:
  HoleFilling(const SurfaceCurve& curve, const ToneField& tone, const DotSequence& sequence, double limit_m)
      : curve_(curve),
        tone_(tone),
        dots_(sequence.dots),
        squares_(curve),
        grid_(dots_, kCellPitches * sequence.pitch_m),
        path_(dots_),
        meter_(curve.surface(), tone, grid_, limit_m, darkest_at(tone, curve.mesh(), dots_)) {}

  /// Makes a Voronoi diagram for each chart and fills its holes; returns the number of dots added.
  std::uint64_t fill_circles() {
    std::vector<GapMeter::Hole> holes;
    for (std::uint32_t s = 0; s < curve_.charts().size(); ++s) {
      if (curve_.charts()[s].kind == ChartKind::kHilbertCube) continue;
      auto found = holes_on(s);
      holes.insert(holes.end(), found.begin(), found.end());
    }
    std::stable_sort(holes.begin(), holes.end(),
                     [](const auto& a, const auto& b) { return a.size > b.size; });
    std::uint64_t added = 0;
    for (const GapMeter::Hole& hole : holes) added += fill(hole.point, slack_at(hole.point));
    return added;
  }

  /// Proves each piece of the surface covered or adds a dot there; returns the number of dots added.
  std::uint64_t sweep() {
    const std::size_t triangles = curve_.mesh().triangle_count();
    std::vector<std::vector<GapMeter::Suspect>> suspects(kBlocks);
    tbb::parallel_for(std::size_t{0}, kBlocks, [&](std::size_t block) {
      for (std::size_t t = block * triangles / kBlocks; t < (block + 1) * triangles / kBlocks; ++t)
        meter_.find_suspects(static_cast<std::uint32_t>(t), suspects[block]);
    });
    std::uint64_t added = 0;
    for (const auto& of_block : suspects)
      for (const GapMeter::Suspect& suspect : of_block) added += fill(suspect.point, suspect.radius_m);
    return added;
  }

  std::vector<Dot> take_dots() { return path_.in_order(); }

 private:
  double slack_at(const SurfacePoint& point) const {
    const double asked = tone_.asked(point);
    return asked > 0 ? kMargin * meter_.limit_m() / std::sqrt(asked) : 0;
  }

  /// Adds a dot in the middle of the hole around a point, if there still is one.
  bool fill(const SurfacePoint& point, double slack_m) {
    const GapMeter::Hole hole = meter_.hole_at(point, slack_m);
    if (!(hole.size > 0)) return false;
    const Dot dot = make_dot(curve_.surface(), tone_, point, squares_.component(point.triangle));
    const auto nearby = grid_.within(dot.position_O, dot.normal_O, kNeighborhoodRadii * hole.radius_m);
    dots_.push_back(dot);
    path_.insert_last(nearby);
    grid_.add(static_cast<std::uint32_t>(dots_.size() - 1));
    return true;
  }

  std::vector<GapMeter::Hole> holes_on(std::uint32_t chart) const {
    std::vector<std::uint32_t> members;
    std::vector<Vector2d> places;
    for (std::uint32_t i = 0; i < dots_.size(); ++i) {
      const auto place = squares_.place(point_of(curve_.mesh(), dots_[i]));
      if (!place || place->chart != chart) continue;
      members.push_back(i);
      places.push_back(place->place);
    }
    const auto triples = voronoi_triples(places, curve_.charts()[chart].square_count);
    std::vector<GapMeter::Hole> holes(triples.size());
    tbb::parallel_for(std::size_t{0}, triples.size(), [&](std::size_t i) {
      holes[i] = hole_between(members[triples[i][0]], members[triples[i][1]], members[triples[i][2]]);
    });
    std::erase_if(holes, [](const auto& hole) { return !(hole.size > 0); });
    return holes;
  }

  /// The hole in the middle of three dots, measured in space.
  GapMeter::Hole hole_between(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
    const auto center = circle_center(dots_[a].position_O, dots_[b].position_O, dots_[c].position_O);
    if (!center) return {};
    const double radius = (*center - dots_[a].position_O).norm();
    if (radius < (1 - kMargin) * meter_.strictest_m()) return {};
    SurfacePoint point = point_of(curve_.mesh(), dots_[std::min({a, b, c})]);
    double distance = (position(curve_.mesh(), point) - *center).norm();
    for (int walk = 0; walk < kMaxWalks; ++walk) {
      const SurfacePoint next = walk_towards(curve_.surface(), point, *center);
      const double nearer = (position(curve_.mesh(), next) - *center).norm();
      if (!(nearer < distance)) break;
      point = next;
      distance = nearer;
    }
    return meter_.hole_at(point, slack_at(point));
  }

  const SurfaceCurve& curve_;
  const ToneField& tone_;
  std::vector<Dot> dots_;
  SquarePlaces squares_;
  DotGrid grid_;
  DotPath path_;
  GapMeter meter_;
};

}  // namespace

DotSequence fill_holes(const SurfaceCurve& curve, const ToneField& tone, DotSequence dots,
                       double largest_gap_pitches, FillReport* report, const Progress& progress) {
  if (!(largest_gap_pitches >= kMinGapPitches))
    throw InputError("largest_gap", "must be at least .5 pitches: even a hexagonal grid has gaps of .62");
  FillReport result;
  if (!dots.dots.empty()) {
    HoleFilling filling(curve, tone, dots, largest_gap_pitches * dots.pitch_m);
    for (std::uint64_t added = 1; added > 0 && result.voronoi_rounds < kMaxRounds; ++result.voronoi_rounds) {
      added = filling.fill_circles();
      result.added += added;
      progress((result.voronoi_rounds + 1.) / (kMaxRounds + 1));
    }
    result.added_by_sweep = filling.sweep();
    result.added += result.added_by_sweep;
    dots.dots = filling.take_dots();
  }
  progress(1);
  if (report) *report = result;
  return dots;
}

}  // namespace hilbrush
