#pragma once
#include <span>

#include "planner/poses/posed_dots.h"
#include "sampling/base/progress.h"

/// A pose for each dot and the order in which dots are exposed, so that the cell takes little time at small
/// incidence:
///   shared_beams (beam directions that many dots share) -> stations (table, yaw and elbow for each
///   direction, in the order they are visited) -> unserved_dots -> ordering (the path over each station's
///   dots) -> yaw_redundancy (yaw along the path).
/// With the table at rest a dot costs little more than settling and its pulse; tables move only between
/// stations.
namespace hilbrush {

/// Cost: 15 (fast, many dots) to 200 (quality) microseconds a dot and core; memory O(dots). The same for any
/// number of threads.
PosedDots search_poses(const Reach& reach, const DotSequence& dots,
                       std::span<const std::uint32_t> dot_indices, const Progress& progress = {});

}  // namespace hilbrush
