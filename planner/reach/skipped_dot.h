#pragma once
#include <cstdint>
#include <string>
#include <string_view>

/// Why a dot is not exposed.
namespace hilbrush {

/// In the order of kSkipReasonNames.
enum class SkipReason : std::uint8_t {
  kOccluded,    ///< every beam within the cone is blocked by the object
  kIncidence,   ///< no pose brings the beam within the cone
  kJointLimit,  ///< the poses that would do exceed a joint's limits
  kLensObject,  ///< the lens body or quill would touch the object
  kLensTable,   ///< ... or the table plate, post
  kEnergy,      ///< the laser cannot deliver the dot's energy
  kArm,         ///< a link of the arm or the robot's column would touch the object, the table or the tool
  kNoPath       ///< there are poses, but no clear path to one
};
inline constexpr int kSkipReasonCount = 8;
/// As reports name it: "occluded", "incidence", "joint_limit", "lens_object", "lens_table", "energy", "arm",
/// "no_way".
const char* skip_reason_name(SkipReason reason);

/// What SkippedDot::amount measures.
enum class SkipMeasure : std::uint8_t {
  kNone,          ///< there is no amount
  kExcessAngle,   ///< rad past a limit
  kExcessLength,  ///< m past a limit, or too near
  kFreeLength     ///< m of the beam that are free, from the dot to what blocks it: the less, the worse
};

struct SkippedDot {
  std::uint32_t dot_index = 0;
  SkipReason reason = SkipReason::kOccluded;
  std::string detail;  ///< a sentence with the amount, where there is one
  std::string_view what =
      {};             ///< the same without the amount, so that dots can be counted by it; of static storage
  double amount = 0;  ///< the amount in the sentence, rad or m
  SkipMeasure measure = SkipMeasure::kNone;
};

}  // namespace hilbrush
