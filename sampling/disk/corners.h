#pragma once
#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "sampling/disk/cut_to_disk.h"

/// Where on the boundary of a disk the corners of its square go.
namespace hilbrush {

/// Indices of sides of CutDisk::outer, rising except where they wrap around; the side from the first to the
/// second lies at the bottom.
using Corners = std::array<std::size_t, 4>;

/// Length along the outer loop before each side; its whole length is the last element.
std::vector<double> lengths_along(const CutDisk& cut);

/// Length of the boundary between each corner and the next.
std::array<double, 4> side_lengths(const Corners& corners, const std::vector<double>& along);

/// How far along the square's boundary each side of the outer loop should begin, in a unit that is constant
/// along each side of the square; the whole boundary is the last element. A slit without forks: as conformal
/// maps place it if the surface is a sphere that is slit from pole to pole. Else by length.
std::vector<double> boundary_measure(const CutDisk& cut, const std::vector<double>& along);

/// A slit: where these maps have the square's corners. Another cut disk: the forks where opposite sides
/// become about equal, else quarters of the length. A component that is a disk without cuts: its own sharp
/// corners, or quarters. The outer loop must have four sides or more.
Corners choose_corners(const CutDisk& cut, const std::vector<double>& along);

/// For a slit whose conformal image, with the corners of choose_corners(), is a rectangle `modulus` times as
/// wide as high: other corners that make it a whole number of squares. None if it fits already, or is not a
/// slit.
std::optional<Corners> corners_for_whole_squares(const CutDisk& cut, const std::vector<double>& along,
                                                 double modulus);

}  // namespace hilbrush
