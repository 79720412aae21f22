#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>

/// Pieces of triangles: what a quad of the curve's tree cuts out of the surface.
namespace hilbrush {

/// A corner of a piece: its place where the tree divides (the unit square, or space) and where it is in its
/// triangle.
template <int kDimensions>
struct PieceCorner {
  Eigen::Matrix<double, kDimensions, 1> place;
  Eigen::Vector2d b;  ///< second and third barycentric coordinate
};

/// A convex polygon within one mesh triangle.
template <int kDimensions>
struct Piece {
  using Corner = PieceCorner<kDimensions>;
  static constexpr std::size_t kMaxCorners = 12;  ///< a triangle cut by the six sides of a cube has nine

  std::uint32_t corner_count = 0;
  std::array<Corner, kMaxCorners> corners;

  Piece() = default;
  ~Piece() = default;
  /// Only the corners in use are copied: most pieces have four.
  Piece(const Piece& other) { *this = other; }
  Piece& operator=(const Piece& other) {
    corner_count = other.corner_count;
    for (std::uint32_t i = 0; i < corner_count; ++i) corners[i] = other.corners[i];
    return *this;
  }

  std::span<const Corner> all() const { return {corners.data(), corner_count}; }

  void add(const Corner& corner) {
    // A convex polygon never has more. One that rounding has bent loses a corner, which does no harm.
    if (corner_count == kMaxCorners) return;
    if (corner_count > 0 && corners[corner_count - 1].b == corner.b) return;
    corners[corner_count++] = corner;
  }

  /// In barycentric coordinates: .5 for the whole triangle.
  double area_b() const {
    double twice = 0;
    for (std::uint32_t i = 2; i < corner_count; ++i) {
      const Eigen::Vector2d u = corners[i - 1].b - corners[0].b, v = corners[i].b - corners[0].b;
      twice += u.x() * v.y() - u.y() * v.x();
    }
    return .5 * std::abs(twice);
  }
};

/// Cuts a piece by the plane place[axis] = at, and hands the corners of its parts on, in order. What lies on
/// the plane belongs to the upper part. Both parts get identical new corners, so that no area is lost or
/// counted twice, whatever the rounding.
template <int kDimensions, class AddLower, class AddUpper>
void cut_corners(const Piece<kDimensions>& piece, int axis, double at, AddLower add_lower,
                 AddUpper add_upper) {
  if (piece.corner_count == 0) return;
  const auto* p = &piece.corners[piece.corner_count - 1];
  double dp = p->place[axis] - at;
  for (std::uint32_t i = 0; i < piece.corner_count; ++i) {
    const auto* q = &piece.corners[i];
    const double dq = q->place[axis] - at;
    if ((dp < 0) != (dq < 0)) {
      const double f = dp / (dp - dq);
      PieceCorner<kDimensions> crossing{p->place + f * (q->place - p->place), p->b + f * (q->b - p->b)};
      crossing.place[axis] = at;
      add_lower(crossing);
      add_upper(crossing);
    }
    if (dq < 0)
      add_lower(*q);
    else
      add_upper(*q);
    p = q;
    dp = dq;
  }
}

template <int kDimensions>
void cut_piece(const Piece<kDimensions>& piece, int axis, double at, Piece<kDimensions>& lower,
               Piece<kDimensions>& upper) {
  using Corner = PieceCorner<kDimensions>;
  lower.corner_count = upper.corner_count = 0;
  cut_corners(
      piece, axis, at, [&](const Corner& corner) { lower.add(corner); },
      [&](const Corner& corner) { upper.add(corner); });
}

/// One part only.
template <int kDimensions>
Piece<kDimensions> part_of(const Piece<kDimensions>& piece, int axis, double at, bool is_upper) {
  using Corner = PieceCorner<kDimensions>;
  Piece<kDimensions> part;
  const auto keep = [&](const Corner& corner) { part.add(corner); };
  const auto drop = [](const Corner&) {};
  if (is_upper)
    cut_corners(piece, axis, at, drop, keep);
  else
    cut_corners(piece, axis, at, keep, drop);
  return part;
}

}  // namespace hilbrush
