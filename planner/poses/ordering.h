#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "planner/poses/step_cost.h"

/// The order of dots that are exposed from one pose of the table: an open path, first as the curve has it,
/// then improved locally by 2-opt and Or-opt over near neighbors. A step costs what the cell takes for it:
/// the slowest axis in whole ticks, and settling. So rows form along the direction that is cheaper for the
/// arm. After Croes 1958, Or 1976, Bentley 1992 (neighbor lists, don't-look bits); differs: moves are limited
/// to a window, so that cost and memory are linear.
namespace hilbrush {

/// A dot on the path.
struct PathDot {
  Eigen::Vector3f position_O;
  ArmJoints arm;
  ArmJoints per_yaw{};  ///< how the joints follow the yaw; zero: the tool does not turn
};

/// The dots' indices in their new order, ends free. `kicks` per dot: how often a neighborhood is perturbed
/// and improved again (iterated local search, Martin, Otto and Felten 1991), which is worth half a per cent
/// of the painting time. Cost O(n), about 5 microseconds a dot and 20 a kick; memory about 100 bytes a dot.
std::vector<std::uint32_t> improved_order(const CellDescription& cell, std::span<const PathDot> path,
                                          std::size_t kicks);

}  // namespace hilbrush
