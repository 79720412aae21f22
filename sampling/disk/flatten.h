#pragma once
#include <algorithm>
#include <string>
#include <vector>

#include "sampling/disk/components.h"

/// From a component of the mesh to squares that curves can walk: cut, map, and, where no map of the whole is
/// valid, divide.
namespace hilbrush {

/// A face on the square, and the part of a mesh triangle that it covers.
struct FlatFace {
  std::uint32_t triangle = 0;
  std::array<Eigen::Vector2d, 3> places;       ///< in [0, square_count] x [0, 1]
  std::array<Eigen::Vector2d, 3> barycentric;  ///< second and third coordinate in the triangle
};

struct FlatPiece {
  std::vector<FlatFace> faces;  ///< counter-clockwise on the square ...
  int square_count = 1;
  std::vector<std::uint32_t>
      triangles_in_space;  ///< ... or, if no valid map was found: to be ordered in space
  /// Where on the surface the corners of the row of squares lie (or near which points of it those of its
  /// bounding box): lower left, lower right, upper right, upper left.
  std::array<Eigen::Vector3d, 4> corners_O;

  bool is_mapped() const { return triangles_in_space.empty(); }
};

struct FlatComponent {
  std::vector<FlatPiece> pieces;  ///< one, unless it had to be divided
  double cut_length_m = 0;        ///< of all cuts that open it, not of those that divide it
  double shear = 1;               ///< SquareMap::shear, mean over the mapped pieces by area
  std::string reason;             ///< why it was divided or not mapped

  bool is_mapped() const {
    return std::ranges::all_of(pieces, [](const FlatPiece& piece) { return piece.is_mapped(); });
  }
};

/// The vertices nearest to the lower four corners of the box around some triangles.
std::array<Eigen::Vector3d, 4> box_corners(const TexturedMesh& mesh,
                                           const std::vector<std::uint32_t>& triangles);

/// `area_share` of the whole mesh's surface decides how much the component may be refined. Deterministic, may
/// be called from several threads. Cost as cut_to_disk and map_to_square; a few times that for a component
/// that must be divided.
FlatComponent flatten(const TexturedMesh& mesh, const Neighbors& neighbors, const Component& component,
                      double area_share);

}  // namespace hilbrush
