#pragma once
#include <numbers>

#include "sampling/base/enum_names.h"

/// Settings of planning, and the names of their choices: plain values, so that config/ can read them.
namespace hilbrush {

/// What a plan is optimized for.
enum class Planning {
  kQuality,   ///< beams nearest to the normals, for a few per cent more painting time
  kBalanced,  ///< default
  kFast       ///< the shortest painting time within the preferred incidence, and the least planning time
};

inline constexpr EnumName<Planning> kPlanningNames[] = {
    {Planning::kQuality, "quality"},
    {Planning::kBalanced, "balanced"},
    {Planning::kFast, "fast"},
};

inline const char* planning_name(Planning planning) {
  return name_of(kPlanningNames, planning);
}

/// In which order dots are exposed.
enum class DotOrder {
  kImproved,  ///< tours over the dots that one pose of the table serves, along the curve and then improved
              ///< locally
  kCurve      ///< such tours along the curve as it is
};

inline constexpr EnumName<DotOrder> kOrderNames[] = {
    {DotOrder::kImproved, "improved"},
    {DotOrder::kCurve, "curve"},
};

inline const char* order_name(DotOrder order) {
  return name_of(kOrderNames, order);
}

/// How poses follow from dots.
enum class PosePolicy {
  kSearch,       ///< many dots share a pose of the table
  kFollowNormal  ///< the baseline: dots as they come, the table turned for each so that the beam meets it
                 ///< along the normal
};

inline constexpr EnumName<PosePolicy> kPolicyNames[] = {
    {PosePolicy::kSearch, "search"},
    {PosePolicy::kFollowNormal, "follow_normal"},
};

inline const char* policy_name(PosePolicy policy) {
  return name_of(kPolicyNames, policy);
}

struct PlanOptions {
  double max_incidence = std::numbers::pi / 4;  ///< rad, against the face normal; never exceeded
  double preferred_incidence =
      std::numbers::pi / 9;  ///< rad, against the smooth normal; exceeded only where a dot
                             ///< cannot be exposed within it. Less than 5 degrees count as 5
  Planning planning = Planning::kBalanced;
  DotOrder order = DotOrder::kImproved;
  PosePolicy policy = PosePolicy::kSearch;
};

}  // namespace hilbrush
