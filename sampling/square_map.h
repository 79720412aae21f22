#pragma once
#include <optional>
#include <vector>

#include "sampling/cut_to_disk.h"

/// The map of a disk onto the unit square. It only orders the surface and says where to walk; areas and masses are
/// always measured in space, so its stretch does no harm but to the depth of the quadtree.
namespace hilbrush {

/// A place for each vertex of the disk.
using SquareMap = std::vector<Eigen::Vector2d>;

/// Boundary onto the square's sides by length, the inside by the convex combination map (Floater 1997) with clamped
/// cotan weights, or, where that leaves a flipped face, mean-value weights. Splits edges of the disk that join two
/// boundary vertices on one side of the square. Returns nothing if no map without a flipped face is found (tested
/// exactly). Cost: one sparse Cholesky factor, about 1.5 s for 270,000 faces.
std::optional<SquareMap> map_to_square(CutDisk& cut);

/// Faces whose orientation on the map is not counter-clockwise.
std::size_t count_flipped(const Disk& disk, const SquareMap& map);

}  // namespace hilbrush
