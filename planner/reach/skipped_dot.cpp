#include "planner/reach/skipped_dot.h"

#include <array>

namespace hilbrush {
namespace {

/// By SkipReason. Reports use these names as keys.
constexpr std::array<const char*, kSkipReasonCount> kSkipReasonNames{
    "occluded", "incidence", "joint_limit", "lens_object", "lens_table", "energy", "arm", "no_way"};

}  // namespace

const char* skip_reason_name(SkipReason reason) {
  const auto index = static_cast<std::size_t>(reason);
  return index < kSkipReasonNames.size() ? kSkipReasonNames[index] : "unknown";
}

}  // namespace hilbrush
