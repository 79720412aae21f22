#pragma once
#include <array>
#include <cstddef>
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

/// A cut disk: the forks where opposite sides become alike, else quarters of the length. A disk by nature: its own
/// sharp corners, or quarters. The outer loop must have four sides or more.
Corners choose_corners(const CutDisk& cut, const std::vector<double>& along);

}  // namespace hilbrush
