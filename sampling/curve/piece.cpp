#include "sampling/curve/piece.h"

#include <algorithm>
#include <cmath>

namespace hilbrush {
namespace {

bool has_area(const Piece& piece) {
  return piece.corner_count >= 3 && area_b(piece) > 0;
}

}  // namespace

Piece& Piece::operator=(const Piece& other) {
  if (this == &other) return *this;
  triangle = other.triangle;
  corner_count = other.corner_count;
  std::copy_n(other.corners.begin(), corner_count, corners.begin());
  return *this;
}

void Piece::add(const PieceCorner& corner) {
  // The cap is never met by a convex polygon; one that rounding has bent loses a corner on which nothing depends.
  if (corner_count == kMostCorners) return;
  if (corner_count > 0 && corners[corner_count - 1].b == corner.b) return;
  corners[corner_count++] = corner;
}

void cut_piece(const Piece& piece, int axis, double at, Piece& lower, Piece& upper) {
  lower.triangle = upper.triangle = piece.triangle;
  lower.corner_count = upper.corner_count = 0;
  for (std::uint32_t i = 0; i < piece.corner_count; ++i) {
    const PieceCorner& p = piece.corners[i];
    const PieceCorner& q = piece.corners[i + 1 == piece.corner_count ? 0 : i + 1];
    const double dp = p.place[axis] - at, dq = q.place[axis] - at;
    (dp < 0 ? lower : upper).add(p);
    if ((dp < 0) == (dq < 0)) continue;
    const double f = dp / (dp - dq);
    PieceCorner crossing{p.place + f * (q.place - p.place), p.b + f * (q.b - p.b)};
    crossing.place[axis] = at;
    lower.add(crossing);
    upper.add(crossing);
  }
}

double area_b(const Piece& piece) {
  double twice = 0;
  for (std::uint32_t i = 2; i < piece.corner_count; ++i) {
    const Eigen::Vector2d u = piece.corners[i - 1].b - piece.corners[0].b, v = piece.corners[i].b - piece.corners[0].b;
    twice += u.x() * v.y() - u.y() * v.x();
  }
  return .5 * std::abs(twice);
}

double area_on_square(const Piece& piece) {
  double twice = 0;
  for (std::uint32_t i = 2; i < piece.corner_count; ++i) {
    const Eigen::Vector3d u = piece.corners[i - 1].place - piece.corners[0].place;
    const Eigen::Vector3d v = piece.corners[i].place - piece.corners[0].place;
    twice += u.x() * v.y() - u.y() * v.x();
  }
  return .5 * std::abs(twice);
}

ToneIntegral integrate(const ToneField& tone, const Piece& piece) {
  std::array<Eigen::Vector2d, Piece::kMostCorners> polygon;
  for (std::uint32_t i = 0; i < piece.corner_count; ++i) polygon[i] = piece.corners[i].b;
  return tone.integrate(piece.triangle, {polygon.data(), piece.corner_count});
}

template <unsigned kChildCount>
std::array<std::vector<Piece>, kChildCount> cut_into_children(std::span<const Piece> pieces,
                                                              const Eigen::Vector3d& middle) {
  std::array<std::vector<Piece>, kChildCount> children;
  const auto cut = [&](auto& self, const Piece& piece, int axis, unsigned place) -> void {
    if (!has_area(piece)) return;
    if ((1u << axis) == kChildCount) {
      children[place].push_back(piece);
      return;
    }
    double low = piece.corners[0].place[axis], high = low;
    for (const PieceCorner& corner : piece.all()) {
      low = std::min(low, corner.place[axis]);
      high = std::max(high, corner.place[axis]);
    }
    if (high < middle[axis]) return self(self, piece, axis + 1, place);
    if (low >= middle[axis]) return self(self, piece, axis + 1, place | (1u << axis));
    Piece lower, upper;
    cut_piece(piece, axis, middle[axis], lower, upper);
    self(self, lower, axis + 1, place);
    self(self, upper, axis + 1, place | (1u << axis));
  };
  for (const Piece& piece : pieces) cut(cut, piece, 0, 0);
  return children;
}

template std::array<std::vector<Piece>, 4> cut_into_children<4>(std::span<const Piece>, const Eigen::Vector3d&);
template std::array<std::vector<Piece>, 8> cut_into_children<8>(std::span<const Piece>, const Eigen::Vector3d&);

}  // namespace hilbrush
