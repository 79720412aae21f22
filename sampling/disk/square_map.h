#pragma once
#include <optional>
#include <vector>

#include "sampling/disk/cut_to_disk.h"

/// The map of a disk onto the unit square, or, for a long strip, onto a row of squares. It only orders the
/// surface for the walk; areas and masses are always measured in space, so its change of scale costs only
/// depth of the quadtree. Shear does harm: it lengthens the curve.
namespace hilbrush {

struct SquareMap {
  std::vector<Eigen::Vector2d> places;  ///< of each vertex of the disk, in [0, square_count] x [0, 1]
  int square_count = 1;
  double shear = 1;  ///< mean over the surface of the larger stretch over the smaller one; 1 is conformal
  double lengthening =
      1;  ///< of a curve that runs both ways equally often: mean of (sqrt(shear) + 1 / sqrt(shear)) / 2
};

/// First the boundary is spread over the sides of the square (corners.h: a slit as if it were a sphere's),
/// the inside by the convex combination map (Tutte 1963, Floater 1997) with clamped cotan weights: one
/// factor. Where that is too sheared, a slit's corners are moved so that it becomes a whole number of
/// squares, and the boundary slides: x solves with the left and right sides fixed only, y with the bottom and
/// top, which is as conformal as the weights are, onto a rectangle of the disk's own module - the square disk
/// orbifold of Aigerman and Lipman, "Orbifold Tutte Embeddings", 2015: mirrored at its sides the disk tiles a
/// torus, so that positive symmetric weights give no flipped face. Where rounding flips one, in a finger that
/// the map shrinks to nothing, the cut is extended into the finger; finally mean-value weights are tried.
/// Splits edges of the disk that join two boundary vertices on one side of the square. Returns nothing if no
/// map without a flipped face is found (tested exactly). Cost: a sparse Cholesky factor or three, 1 s each
/// for 270,000 faces.
std::optional<SquareMap> map_to_square(CutDisk& cut);

/// Faces whose orientation on the map is not counter-clockwise.
std::size_t count_flipped(const Disk& disk, const std::vector<Eigen::Vector2d>& places);

}  // namespace hilbrush
