#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

/// The Voronoi diagram in the plane.
namespace hilbrush {

/// For each vertex of the Voronoi diagram of points in [0, width] x [0, 1]: the three points around it (where
/// more meet, the first three), as indices. Points that coincide count once. Boost.Polygon, on a grid of 2^30
/// steps. Cost O(n log n).
std::vector<std::array<std::uint32_t, 3>> voronoi_triples(std::span<const Eigen::Vector2d> points,
                                                          double width);

}  // namespace hilbrush
