#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <unordered_set>

#include "sampling/base/input_error.h"
#include "sampling/model/nearest_in_triangle.h"
#include "sampling/quality/point_tree.h"
#include "sampling/quality/spectrum.h"
#include "sampling/quality/surface_quality.h"
#include "sampling/quality/test_shapes.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d, Eigen::Vector3d;

/// Radius of a patch in pitches.
constexpr double kRadius = 10;
/// Patches that are tried; those that bend too much are left out.
constexpr std::size_t kPatches = 256;
/// Rings up to twice the principal frequency: 1/16 of it each.
constexpr std::size_t kRings = 32;
/// Directions over half a turn.
constexpr std::size_t kDirections = 8;
/// A patch may bend by 60 degrees: the least cosine between the normals of its center and of its triangles.
constexpr double kMinCosine = .5;
/// A patch holds about 300 dots, so with fewer dots than this there is hardly a patch.
constexpr std::size_t kMinDots = 100;
/// Longest side of the pieces that stand for the even density, in pitches: their own rows show only above the
/// highest frequency.
constexpr double kMaxPiecePitches = .45;

struct Weighted {
  Vector2d place;  ///< on the tangent plane, in pitches
  double weight;
};

/// A patch: its dots, and the even density with which they are compared.
struct FlatPatch {
  std::vector<Weighted> dots, even;
  double squares = 0;  ///< expected sum of squared weights of the dots
  bool is_flat_enough = true;
};

/// Fades out towards the border of the patch.
double window(double distance_pitches) {
  const double s = 1 - std::pow(distance_pitches / kRadius, 2);
  return s <= 0 ? 0 : s * s;
}

/// The tangent plane around a surface point; lengths are those of chords, so that a bent surface keeps its
/// extent.
class TangentPlane {
 public:
  TangentPlane(const Vector3d& center, const Vector3d& normal, double turn, double pitch)
      : center_(center), normal_(normal), pitch_(pitch) {
    const Vector3d any = normal.unitOrthogonal();
    x_ = std::cos(turn) * any + std::sin(turn) * normal.cross(any);
    y_ = normal.cross(x_);
  }
  Vector2d operator()(const Vector3d& place) const {
    const Vector3d offset = (place - center_) / pitch_;
    const Vector2d flat(offset.dot(x_), offset.dot(y_));
    const double length = flat.norm();
    return length > 0 ? Vector2d(flat * (offset.norm() / length)) : flat;
  }
  const Vector3d& center() const { return center_; }
  const Vector3d& normal() const { return normal_; }

 private:
  Vector3d center_, normal_, x_, y_;
  double pitch_;
};

class PatchMaker {
 public:
  PatchMaker(const SurfaceQuality::Implementation& surface, std::span<const Dot> dots,
             const PointTree<3>& tree)
      : surface_(surface),
        dots_(dots),
        tree_(tree),
        pitch_(std::sqrt(surface.mass / static_cast<double>(dots.size()))) {}

  FlatPatch make(const SurfacePoint& center, double turn) const {
    const double pitch = pitch_ / std::sqrt(std::max(surface_.density(center), 1e-6));
    const TangentPlane plane(position(surface_.mesh, center), face_normal(surface_.mesh, center), turn,
                             pitch);
    FlatPatch patch;
    const std::unordered_set<std::uint32_t> triangles =
        connected_triangles(center.triangle, plane, pitch, patch);
    if (!patch.is_flat_enough) return patch;
    std::vector<std::uint32_t> ordered(triangles.begin(), triangles.end());
    std::sort(ordered.begin(), ordered.end());
    for (const std::uint32_t t : ordered)
      add_even(t, {surface_.mesh.corner(t, 0), surface_.mesh.corner(t, 1), surface_.mesh.corner(t, 2)}, plane,
               pitch, patch);
    std::vector<std::uint32_t> inside;
    tree_.visit_near(plane.center(), kRadius * pitch, [&](std::uint32_t i, const Vector3d&) {
      if (triangles.contains(dots_[i].triangle)) inside.push_back(i);
    });
    std::sort(inside.begin(), inside.end());
    for (const std::uint32_t i : inside) {
      const Vector2d place = plane(dots_[i].position_O);
      if (const double weight = window(place.norm()); weight > 0) patch.dots.push_back({place, weight});
    }
    return patch;
  }

 private:
  /// The triangles that the ball touches and that are connected with the center's within it.
  std::unordered_set<std::uint32_t> connected_triangles(std::uint32_t start, const TangentPlane& plane,
                                                        double pitch, FlatPatch& patch) const {
    std::unordered_set<std::uint32_t> found{start};
    std::vector<std::uint32_t> open{start};
    while (!open.empty()) {
      const std::uint32_t t = open.back();
      open.pop_back();
      if (surface_.mesh.area_vector(t).normalized().dot(plane.normal()) < kMinCosine)
        patch.is_flat_enough = false;
      for (const TriangleSide& side : surface_.neighbors[t]) {
        if (side == kNoSide || found.contains(side.triangle)) continue;
        const auto corner = [&](int c) -> const Vector3d& { return surface_.mesh.corner(side.triangle, c); };
        const Vector3d b = nearest_in_triangle(plane.center(), corner(0), corner(1), corner(2));
        const Vector3d nearest = position(surface_.mesh, {side.triangle, b});
        if ((nearest - plane.center()).norm() >= kRadius * pitch) continue;
        found.insert(side.triangle);
        open.push_back(side.triangle);
      }
    }
    return found;
  }

  /// The even density of a triangle as many small weights.
  void add_even(std::uint32_t t, const std::array<Vector3d, 3>& corners, const TangentPlane& plane,
                double pitch, FlatPatch& patch) const {
    std::size_t longest = 0;
    double length = 0;
    for (std::size_t k = 0; k < 3; ++k)
      if (const double side = (corners[(k + 1) % 3] - corners[k]).norm(); side > length) {
        length = side;
        longest = k;
      }
    const Vector3d middle = (corners[0] + corners[1] + corners[2]) / 3;
    if (length > kMaxPiecePitches * pitch) {
      if ((middle - plane.center()).norm() - length > kRadius * pitch) return;
      const Vector3d half = (corners[longest] + corners[(longest + 1) % 3]) / 2;
      std::array<Vector3d, 3> a = corners;
      std::array<Vector3d, 3> b = corners;
      a[(longest + 1) % 3] = half;
      b[longest] = half;
      add_even(t, a, plane, pitch, patch);
      add_even(t, b, plane, pitch, patch);
      return;
    }
    const Vector2d place = plane(middle);
    const double fade = window(place.norm());
    if (!(fade > 0)) return;
    const double area = .5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).norm();
    const double expected = area * surface_.density_at(middle, t) / (pitch_ * pitch_);
    patch.even.push_back({place, expected * fade});
    patch.squares += expected * fade * fade;
  }

  const SurfaceQuality::Implementation& surface_;
  std::span<const Dot> dots_;
  const PointTree<3>& tree_;
  double pitch_;
};

/// The transform of the patch's dots minus its even density: sum of weight * exp(-2 pi i f direction . place)
/// at the middles of all rings.
std::array<std::complex<double>, kRings> transform(const Eigen::Matrix2Xd& places,
                                                   const Eigen::ArrayXd& weights, const Vector2d& direction) {
  constexpr double kStep = SpectrumSums::kHighest / kRings;
  const Eigen::ArrayXd turns =
      -2 * std::numbers::pi * kStep * (direction.transpose() * places).array().transpose();
  const Eigen::ArrayXd step_x = turns.cos();
  const Eigen::ArrayXd step_y = turns.sin();
  Eigen::ArrayXd x = weights * (turns / 2).cos(), y = weights * (turns / 2).sin(), next_x;
  std::array<std::complex<double>, kRings> sums;
  for (auto& sum : sums) {
    sum = {x.sum(), y.sum()};
    next_x = x * step_x - y * step_y;
    y = x * step_y + y * step_x;
    x.swap(next_x);
  }
  return sums;
}

/// Powers by direction, then ring.
std::vector<double> powers(const FlatPatch& patch) {
  const std::size_t count = patch.dots.size() + patch.even.size();
  Eigen::Matrix2Xd places(2, count);
  Eigen::ArrayXd weights(count);
  Eigen::Index i = 0;
  for (const Weighted& dot : patch.dots) {
    places.col(i) = dot.place;
    weights[i++] = dot.weight;
  }
  for (const Weighted& even : patch.even) {
    places.col(i) = even.place;
    weights[i++] = -even.weight;
  }
  std::vector<double> result;
  for (std::size_t d = 0; d < kDirections; ++d) {
    const double turn = std::numbers::pi * static_cast<double>(d) / kDirections;
    for (const auto& sum : transform(places, weights, {std::cos(turn), std::sin(turn)}))
      result.push_back(std::norm(sum) / patch.squares);
  }
  return result;
}

/// Rings, and the means over the discs below half and a quarter of the principal frequency: a ring's weight
/// is its circumference.
Spectrum spectrum_of(const std::vector<double>& ring_powers) {
  Spectrum spectrum;
  double half = 0;
  double quarter = 0;
  double half_weight = 0;
  double quarter_weight = 0;
  for (std::size_t r = 0; r < kRings; ++r) {
    const double frequency = (static_cast<double>(r) + .5) * SpectrumSums::kHighest / kRings;
    spectrum.rings.push_back({frequency, ring_powers[r], 0});
    if (frequency < .5) {
      half += frequency * ring_powers[r];
      half_weight += frequency;
    }
    if (frequency < .25) {
      quarter += frequency * ring_powers[r];
      quarter_weight += frequency;
    }
  }
  spectrum.below_half = half / half_weight;
  spectrum.below_quarter = quarter / quarter_weight;
  complete_spectrum(spectrum);
  return spectrum;
}

}  // namespace

Spectrum SurfaceQuality::spectrum(std::span<const Dot> dots, std::uint64_t seed) const {
  if (dots.size() < kMinDots)
    throw InputError("", "a spectrum on a surface needs at least " + std::to_string(kMinDots) + " dots");
  const Implementation& surface = *implementation_;
  std::vector<Vector3d> places(dots.size());
  for (std::size_t i = 0; i < dots.size(); ++i) places[i] = dots[i].position_O;
  const PointTree<3> tree(places);
  const PatchMaker maker(surface, dots, tree);
  std::vector<std::vector<double>> of_patches(kPatches);
  tbb::parallel_for(std::size_t{0}, kPatches, [&](std::size_t i) {
    const ShapeNumbers number({kPatches, seed}, 8, i);
    const FlatPatch patch =
        maker.make(surface.random_point(number(0), number(1), number(2)), 2 * std::numbers::pi * number(3));
    if (patch.is_flat_enough && patch.squares > 0) of_patches[i] = powers(patch);
  });
  std::vector<double> rings(kRings, 0.);
  double count = 0;
  for (const auto& patch : of_patches) {
    if (patch.empty()) continue;
    count += kDirections;
    for (std::size_t k = 0; k < patch.size(); ++k) rings[k % kRings] += patch[k];
  }
  if (!(count > 0))
    throw InputError("",
                     "no part of the surface is flat enough for a spectrum: more dots make smaller patches");
  for (double& power : rings) power /= count;
  return spectrum_of(rings);
}

}  // namespace hilbrush
