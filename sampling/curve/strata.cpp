#include "sampling/curve/strata.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace hilbrush {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kMomentDepth = 16;
constexpr int kPlaceDepth = 24;
/// A patch is cut at the end of a stratum to 8^-2 or 4^-3 of itself.
constexpr int kCutDepth = 3;
/// ... and for a dot at a given place along the curve further.
constexpr int kFinalDepth = 8;
constexpr int kMostHalvings = 40;

SurfacePoint surface_point(std::uint32_t triangle, const Vector2d& b) {
  return {triangle, {1 - b.x() - b.y(), b.x(), b.y()}};
}

Crumb crumb_of(const Piece& piece, const ToneIntegral& integral) {
  return {surface_point(piece.triangle, integral.first / integral.mass), integral.mass};
}

/// Barycentric coordinates of a place on the square, in the plane of the piece; and how deep it lies inside it
/// (negative: outside).
struct Inside {
  Vector2d b;
  double depth;
};

Inside locate_in(const Piece& piece, const Vector3d& place) {
  // The widest fan triangle of the piece carries the affine map.
  std::uint32_t best = 2;
  double widest = -1;
  for (std::uint32_t i = 2; i < piece.corner_count; ++i) {
    const Vector3d u = piece.corners[i - 1].place - piece.corners[0].place,
                   v = piece.corners[i].place - piece.corners[0].place;
    const double area = std::abs(u.x() * v.y() - u.y() * v.x());
    if (area > widest) widest = area, best = i;
  }
  const PieceCorner &o = piece.corners[0], &p = piece.corners[best - 1], &q = piece.corners[best];
  const Vector3d u = p.place - o.place, v = q.place - o.place, w = place - o.place;
  const double determinant = u.x() * v.y() - u.y() * v.x();
  if (determinant == 0) return {o.b, -1e300};
  const double f = (w.x() * v.y() - w.y() * v.x()) / determinant, g = (u.x() * w.y() - u.y() * w.x()) / determinant;
  double depth = 1e300;
  const double sign = determinant > 0 ? 1 : -1;
  for (std::uint32_t i = 0; i < piece.corner_count; ++i) {
    const Vector3d& a = piece.corners[i].place;
    const Vector3d edge = piece.corners[i + 1 == piece.corner_count ? 0 : i + 1].place - a;
    const double length = edge.norm();
    if (length > 0) depth = std::min(depth, sign * (edge.x() * (place - a).y() - edge.y() * (place - a).x()) / length);
  }
  return {o.b + f * (p.b - o.b) + g * (q.b - o.b), depth};
}

/// The surface point at a place on the square within a patch.
SurfacePoint lift(const Patch& patch, const Vector3d& place) {
  std::size_t best = 0;
  Inside best_inside{Vector2d::Zero(), -2e300};
  for (std::size_t i = 0; i < patch.pieces.size(); ++i) {
    const Inside inside = locate_in(patch.pieces[i], place);
    if (inside.depth > best_inside.depth) best = i, best_inside = inside;
    if (inside.depth >= 0) break;
  }
  const Vector2d b = best_inside.b.cwiseMax(0.);
  return surface_point(patch.pieces[best].triangle, b.sum() > 1 ? Vector2d(b / b.sum()) : b);
}

Vector3d hilbert_place(HilbertQuad quad, double share) {
  Box box;
  for (int depth = 0; depth < kPlaceDepth; ++depth) {
    const double f = 4 * share;
    const auto i = static_cast<unsigned>(std::clamp(f, 0., 3.));
    box = box.child(quad.place(i));
    quad = quad.child(i);
    share = std::clamp(f - i, 0., 1.);
  }
  Vector3d middle = box.middle();
  middle.z() = 0;
  return middle;
}

/// Mass and moment in space, as of a stretch of the curve.
struct Moment {
  double mass = 0;
  Vector3d moment = Vector3d::Zero();
};

Vector3d moment_of(const TexturedMesh& mesh, const Piece& piece, const ToneIntegral& integral) {
  const Vector3d& origin = mesh.corner(piece.triangle, 0);
  return integral.mass * origin + integral.first.x() * (mesh.corner(piece.triangle, 1) - origin) +
         integral.first.y() * (mesh.corner(piece.triangle, 2) - origin);
}

/// Inside a patch of a fraction of a dot the tone of each piece is taken as even.
struct EvenPiece {
  Piece piece;
  double density;  ///< mass over area_b
};

ToneIntegral even_integral(const EvenPiece& even) {
  ToneIntegral integral;
  for (std::uint32_t i = 2; i < even.piece.corner_count; ++i) {
    const auto& c = even.piece.corners;
    const Vector2d u = c[i - 1].b - c[0].b, v = c[i].b - c[0].b;
    const double mass = even.density * .5 * (u.x() * v.y() - u.y() * v.x());
    integral.mass += mass;
    integral.first += mass / 3 * (c[0].b + c[i - 1].b + c[i].b);
  }
  if (integral.mass < 0) integral.mass = -integral.mass, integral.first = -integral.first;
  return integral;
}

/// Follows the curve within a patch until `share` of its mass has passed.
class PatchCut {
 public:
  PatchCut(const TexturedMesh& mesh, const Patch& patch) : mesh_(mesh) {
    for (std::size_t i = 0; i < patch.pieces.size(); ++i) {
      const double area = area_b(patch.pieces[i]);
      if (area > 0) pieces_.push_back({patch.pieces[i], patch.integrals[i].mass / area});
    }
  }

  void follow(const Patch& patch, double mass, int depth) {
    if (patch.is_in_space)
      descend(patch.box, patch.cube, mass, depth * 2 / 3);
    else
      descend(patch.box, patch.quad, mass, depth);
  }

  const Moment& passed() const { return passed_; }
  const Crumb& last() const { return last_; }

 private:
  template <class Hilbert>
  void descend(const Box& box, Hilbert hilbert, double mass, int depth) {
    if (depth == 0 || pieces_.empty()) return finish(mass);
    std::vector<Piece> plain;
    for (std::size_t i = 0; i < pieces_.size(); ++i) plain.push_back(pieces_[i].piece);
    // Children must find their piece's density again: pieces of one triangle have one each.
    auto children = cut_into_children<Hilbert::kChildCount>(plain, box.middle());
    for (unsigned i = 0; i < Hilbert::kChildCount; ++i) {
      const unsigned place = hilbert.place(i);
      std::vector<EvenPiece> inside;
      Moment child;
      for (const Piece& piece : children[place]) {
        inside.push_back({piece, density_of(piece)});
        const ToneIntegral integral = even_integral(inside.back());
        child.mass += integral.mass;
        child.moment += moment_of(mesh_, piece, integral);
      }
      if (inside.empty()) continue;
      if (mass > child.mass && i + 1 < Hilbert::kChildCount) {
        passed_.mass += child.mass;
        passed_.moment += child.moment;
        mass -= child.mass;
        last_inside_ = inside;
        continue;
      }
      pieces_ = std::move(inside);
      return descend(box.child(place), hilbert.child(i), mass, depth - 1);
    }
    // Rounding has left a little beyond the last child.
    if (!last_inside_.empty()) pieces_ = last_inside_;
    finish(0);
  }

  double density_of(const Piece& piece) const {
    for (const EvenPiece& even : pieces_)
      if (even.piece.triangle == piece.triangle) return even.density;
    return 0;
  }

  void finish(double mass) {
    Moment rest;
    double heaviest = -1;
    for (const EvenPiece& even : pieces_) {
      const ToneIntegral integral = even_integral(even);
      if (!(integral.mass > 0)) continue;
      rest.mass += integral.mass;
      rest.moment += moment_of(mesh_, even.piece, integral);
      if (integral.mass > heaviest) {
        heaviest = integral.mass;
        last_ = crumb_of(even.piece, integral);
      }
    }
    if (!(rest.mass > 0)) return;
    const double f = std::min(1., mass / rest.mass);
    passed_.mass += f * rest.mass;
    passed_.moment += f * rest.moment;
  }

  const TexturedMesh& mesh_;
  std::vector<EvenPiece> pieces_, last_inside_;
  Moment passed_;
  Crumb last_;
};

StratumPart& part_on(Stratum& stratum, std::uint32_t sheet) {
  if (stratum.parts.empty() || stratum.parts.back().sheet != sheet)
    stratum.parts.push_back({sheet, 0, Vector3d::Zero(), {}});
  return stratum.parts.back();
}

/// The first `share` of a patch that is not uniform.
Moment first_share(const TexturedMesh& mesh, const Patch& patch, double share) {
  PatchCut cut(mesh, patch);
  if (share > 0) cut.follow(patch, share * patch.mass, kCutDepth);
  return cut.passed();
}

}  // namespace

const StratumPart& Stratum::heaviest() const {
  return *std::max_element(parts.begin(), parts.end(),
                           [](const StratumPart& a, const StratumPart& b) { return a.mass < b.mass; });
}

void Stratum::append(Stratum&& next) {
  for (StratumPart& part : next.parts) {
    StratumPart& mine = part_on(*this, part.sheet);
    mine.mass += part.mass;
    mine.moment_O += part.moment_O;
    mine.crumbs.insert(mine.crumbs.end(), part.crumbs.begin(), part.crumbs.end());
  }
}

Vector3d hilbert_moment(HilbertQuad quad, double share) {
  Vector3d moment = Vector3d::Zero(), low = Vector3d::Zero();
  double size = 1, weight = 1;  // of the child that the walk is in: side, and share of the curve
  for (int depth = 0; depth < kMomentDepth; ++depth) {
    const double f = 4 * share;
    const auto i = static_cast<unsigned>(std::clamp(f, 0., 3.));
    size /= 2;
    weight /= 4;
    const auto low_of = [&](unsigned place) {
      return Vector3d(low + size * Vector3d(place & 1u, place >> 1u & 1u, 0));
    };
    for (unsigned k = 0; k < i; ++k) moment += weight * (low_of(quad.place(k)) + Vector3d(size / 2, size / 2, 0));
    low = low_of(quad.place(i));
    quad = quad.child(i);
    share = std::clamp(f - i, 0., 1.);
  }
  return moment + weight * share * (low + Vector3d(size / 2, size / 2, 0));
}

void add_stretch(Stratum& stratum, const TexturedMesh& mesh, const Patch& patch, double from, double to) {
  if (!(to > from)) return;
  StratumPart& part = part_on(stratum, patch.sheet);
  const double mass = (to - from) * patch.mass;
  if (patch.is_uniform) {
    const Vector3d mean = (hilbert_moment(patch.quad, to) - hilbert_moment(patch.quad, from)) / (to - from);
    const SurfacePoint centre = lift(patch, Vector3d(patch.box.low.x(), patch.box.low.y(), 0) + patch.box.size * mean);
    part.mass += mass;
    part.moment_O += mass * position(mesh, centre);
    part.crumbs.push_back({centre, mass});
    return;
  }
  for (std::size_t i = 0; i < patch.pieces.size(); ++i) {
    Crumb crumb = crumb_of(patch.pieces[i], patch.integrals[i]);
    crumb.mass *= to - from;
    part.crumbs.push_back(crumb);
  }
  Moment moment;
  if (from <= 0 && to >= 1) {
    for (std::size_t i = 0; i < patch.pieces.size(); ++i)
      moment.moment += moment_of(mesh, patch.pieces[i], patch.integrals[i]);
    moment.mass = patch.mass;
  } else {
    const Moment begin = first_share(mesh, patch, from), end = first_share(mesh, patch, to);
    moment.mass = end.mass - begin.mass;
    moment.moment = end.moment - begin.moment;
  }
  part.mass += mass;
  // The cut is within a percent of its share; the moment is made to fit the exact mass.
  if (moment.mass > 0) part.moment_O += mass / moment.mass * moment.moment;
}

SurfacePoint point_with_tone(const ToneField& tone, Piece piece) {
  for (std::uint32_t i = 0; i < piece.corner_count; ++i)
    piece.corners[i].place = {piece.corners[i].b.x(), piece.corners[i].b.y(), 0};
  ToneIntegral integral = integrate(tone, piece);
  SurfacePoint centre = crumb_of(piece, integral).centre;
  for (int halving = 0; halving < kMostHalvings && !(tone.asked(centre) > 0); ++halving) {
    Piece lower, upper;
    cut_piece(piece, halving % 2, centre.barycentric[1 + halving % 2], lower, upper);
    const ToneIntegral of_lower = integrate(tone, lower), of_upper = integrate(tone, upper);
    const bool is_lower = of_lower.mass > of_upper.mass;
    integral = is_lower ? of_lower : of_upper;
    if (!(integral.mass > 0)) break;
    piece = is_lower ? lower : upper;
    centre = crumb_of(piece, integral).centre;
  }
  return centre;
}

SurfacePoint point_in_heaviest(const ToneField& tone, const Patch& patch) {
  std::size_t best = 0;
  for (std::size_t i = 1; i < patch.integrals.size(); ++i)
    if (patch.integrals[i].mass > patch.integrals[best].mass) best = i;
  return point_with_tone(tone, patch.pieces[best]);
}

SurfacePoint point_at(const ToneField& tone, const Patch& patch, double share) {
  SurfacePoint point;
  if (patch.is_uniform) {
    const Vector3d place = patch.box.size * hilbert_place(patch.quad, share);
    point = lift(patch, Vector3d(patch.box.low.x(), patch.box.low.y(), 0) + place);
  } else {
    PatchCut cut(tone.mesh(), patch);
    cut.follow(patch, share * patch.mass, kFinalDepth);
    point = cut.last().centre;
  }
  return tone.asked(point) > 0 ? point : point_in_heaviest(tone, patch);
}

}  // namespace hilbrush
