#pragma once
#include <optional>
#include <vector>

#include "sampling/disk/cut_to_disk.h"

/// The map of a disk onto the unit square, or, for a long strip, onto a row of squares. It only orders the surface and
/// says where to walk; areas and masses are always measured in space, so its stretch does no harm but to the depth of
/// the quadtree.
namespace hilbrush {

struct SquareMap {
  std::vector<Eigen::Vector2d> places;  ///< of each vertex of the disk, in [0, square_count] x [0, 1]
  int square_count = 1;
};

/// Boundary onto the sides by length, the inside by the convex combination map (Floater 1997) with clamped cotan
/// weights, or, where that leaves a flipped face, mean-value weights. Splits edges of the disk that join two boundary
/// vertices on one side of the square. Returns nothing if no map without a flipped face is found (tested exactly).
/// Cost: one sparse Cholesky factor, about 1.5 s for 270,000 faces.
std::optional<SquareMap> map_to_square(CutDisk& cut);

/// Faces whose orientation on the map is not counter-clockwise.
std::size_t count_flipped(const Disk& disk, const std::vector<Eigen::Vector2d>& places);

}  // namespace hilbrush
