#pragma once
#include "planner/poses/stations.h"

/// Dots that the common stations leave over - deep in hollows, under overhangs, at the edge of the arm's reach - get
/// stations of their own, again shared by as many as can be.
namespace hilbrush {

/// Appends tours with given stations, and the dots that cannot be exposed at all with the reason. Tours that exist
/// already take what they can: each dot joins the one whose beam meets it best.
/// Cost: a full search for a pose for each dot in `left`, in parallel; then clearance tests for dots and poses whose
/// normals agree.
void serve_leftovers(const AimedDots& dots, std::vector<std::uint32_t> left, std::vector<Tour>& tours,
                     std::vector<SkippedDot>& skipped, const Progress& progress = {});

}  // namespace hilbrush
