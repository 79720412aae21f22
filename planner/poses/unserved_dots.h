#pragma once
#include "planner/poses/stations.h"

/// Dots that the common stations do not serve (deep in hollows, under overhangs, at the workspace boundary)
/// get stations of their own, again shared by as many dots as possible.
namespace hilbrush {

/// Appends tours with given stations, and the dots that cannot be exposed at all with the reason. Existing
/// tours come first: each dot joins the one whose beam meets it best, if one serves it. Cost: a full search
/// for a pose for each dot in `unserved`, in parallel; then clearance tests for dots and poses whose normals
/// agree.
void pose_unserved_dots(const DotsToPose& dots, std::vector<std::uint32_t> unserved, std::vector<Tour>& tours,
                        std::vector<SkippedDot>& skipped, const Progress& progress = {});

}  // namespace hilbrush
