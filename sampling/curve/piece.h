#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sampling/tone_field.h"

/// Pieces of triangles: what a quad of the curve's tree cuts out of the surface.
namespace hilbrush {

/// A corner of a piece: its place where the tree divides (the unit square, z = 0; or space) and where it is in its
/// triangle.
struct PieceCorner {
  Eigen::Vector3d place;
  Eigen::Vector2d b;  ///< second and third barycentric coordinate
};

/// A convex polygon within one mesh triangle.
struct Piece {
  static constexpr std::size_t kMostCorners = 12;  ///< a triangle cut by the six sides of a cube has nine

  std::uint32_t triangle = 0;
  std::uint32_t corner_count = 0;
  std::array<PieceCorner, kMostCorners> corners;

  Piece() = default;
  ~Piece() = default;
  /// Only the corners in use are copied: pieces are copied all the time and most have four.
  Piece(const Piece& other) { *this = other; }
  Piece& operator=(const Piece& other);

  std::span<const PieceCorner> all() const { return {corners.data(), corner_count}; }
  void add(const PieceCorner& corner);
};

/// Cuts a piece by the plane place[axis] = at. What lies on the plane belongs to the upper part. Both parts get the
/// very same new corners, so that no area is lost or counted twice, however badly the places are rounded.
void cut_piece(const Piece& piece, int axis, double at, Piece& lower, Piece& upper);

/// Area in units of the triangle's own twice.
double area_b(const Piece& piece);
/// Area on the unit square.
double area_on_square(const Piece& piece);

/// integrate() of the piece.
ToneIntegral integrate(const ToneField& tone, const Piece& piece);

/// Cuts pieces into the children of a box (four in the plane, eight in space), by the place of the child: bit k is set
/// in the upper half along axis k. Pieces without area go.
template <unsigned kChildCount>
std::array<std::vector<Piece>, kChildCount> cut_into_children(std::span<const Piece> pieces,
                                                              const Eigen::Vector3d& middle);

}  // namespace hilbrush
