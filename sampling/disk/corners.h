#pragma once
#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "sampling/disk/cut_to_disk.h"

/// Where on the boundary of a disk the corners of its square go.
namespace hilbrush {

/// Indices of sides of CutDisk::outer, rising but for the turn-round; the side from the first to the second lies at the
/// bottom.
using Corners = std::array<std::size_t, 4>;

/// Length along the outer loop before each side, and all of it at the end.
std::vector<double> lengths_along(const CutDisk& cut);

/// Length of the boundary between each corner and the next.
std::array<double, 4> side_lengths(const Corners& corners, const std::vector<double>& along);

/// How far along the square's boundary each side of the outer loop should begin, in a unit that is even along each side
/// of the square; all of it at the end. A slit without forks: as conformal maps place it if the surface is a sphere
/// that is slit from pole to pole. Else by length.
std::vector<double> boundary_measure(const CutDisk& cut, const std::vector<double>& along);

/// A slit: where these maps have the square's corners. Another cut disk: the forks where opposite sides become alike,
/// else quarters of the length. A disk by nature: its own sharp corners, or quarters. The outer loop must have four
/// sides or more.
Corners choose_corners(const CutDisk& cut, const std::vector<double>& along);

/// Other corners for a slit (of anything else: none) with which it becomes a whole number of squares, where with those
/// of choose_corners() its conformal image is a rectangle `modulus` times as wide as high. None if it fits as it is.
std::optional<Corners> corners_for_whole_squares(const CutDisk& cut, const std::vector<double>& along, double modulus);

}  // namespace hilbrush
