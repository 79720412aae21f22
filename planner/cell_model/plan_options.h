#pragma once
#include <numbers>

/// Settings of planning. Std only, so that config/ can read them.
namespace hilbrush {

/// What a plan is to be good at. Names in settings: "quality", "balanced", "fast".
enum class Planning {
  kQuality,   ///< beams nearest to the normals, for a few per cent more painting time
  kBalanced,  ///< default
  kFast       ///< the shortest painting time within the preferred incidence, and the least planning time
};

/// In which order dots are exposed. Names: "improved", "curve".
enum class DotOrder {
  kImproved,  ///< tours over the dots that one pose of the table serves, along the curve and then improved locally
  kCurve      ///< such tours along the curve as it is
};

/// How poses follow from dots. Names: "search", "follow_normal".
enum class PosePolicy {
  kSearch,       ///< many dots share a pose of the table
  kFollowNormal  ///< the baseline: dots as they come, the table turned for each so that the beam meets it head-on
};

struct PlanOptions {
  double max_incidence = std::numbers::pi / 4;        ///< rad, against the face normal; never exceeded
  double preferred_incidence = std::numbers::pi / 9;  ///< rad, against the smooth normal; exceeded only where a dot
                                                      ///< cannot be exposed within it. Less than 5 degrees count as 5
  Planning planning = Planning::kBalanced;
  DotOrder order = DotOrder::kImproved;
  PosePolicy policy = PosePolicy::kSearch;
};

}  // namespace hilbrush
