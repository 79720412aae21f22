#pragma once
#include <span>
#include <vector>

#include "planner/poses/aims.h"
#include "planner/poses/stations.h"

/// What the slack of the yaw is worth: along a tour, every dot may turn the tool some degrees away from the station's
/// yaw. The focus then moves by J4 as well as by J1 and J2, all along a row, which shortens steps by a control tick or
/// two, or the beam comes nearer to the normal while another axis is the slowest anyway. The cheapest yaws along the
/// path by dynamic programming (Viterbi), time and incidence in one cost.
namespace hilbrush {

/// `posed` are the tour's dots (indices into `dots`) in their order with the joints at the station's own yaw; changed
/// in place. Every pose is looked at like any other; where a turned one does not do, the station's stays.
/// Cost: some 40 microseconds a dot; memory 12 bytes a dot and 2 MB.
void use_yaw_slack(const AimedDots& dots, const AimCosts& costs, const Station& station,
                   std::span<const std::uint32_t> tour, std::span<Joints> joints);

}  // namespace hilbrush
