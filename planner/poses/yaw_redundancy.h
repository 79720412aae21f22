#pragma once
#include <span>
#include <vector>

#include "planner/poses/shared_beams.h"
#include "planner/poses/stations.h"

/// Use of the yaw redundancy: along a tour, the tool may turn some degrees away from the station's yaw at
/// each dot. The focus then moves by J4 as well as by J1 and J2, all along a row, which shortens steps by a
/// control tick or two; or the beam comes nearer to the normal while another axis is the slowest anyway. The
/// cheapest yaws along the path are found by dynamic programming (Viterbi), with time and incidence in one
/// cost.
namespace hilbrush {

/// `tour` are the tour's dots (indices into `dots`) in their order, `joints` their joints at the station's
/// own yaw, changed in place. Every new pose is checked like any other; where it fails, the station's
/// remains. Cost: some 40 microseconds a dot; memory 12 bytes a dot and 2 MB.
void use_yaw_redundancy(const DotsToPose& dots, const PoseCosts& costs, const Station& station,
                        std::span<const std::uint32_t> tour, std::span<Joints> joints);

}  // namespace hilbrush
