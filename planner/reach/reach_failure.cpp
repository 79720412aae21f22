#include "planner/reach/reach_failure.h"

#include <array>
#include <string>
#include <string_view>

#include "sampling/base/angles.h"
#include "sampling/base/text.h"

namespace hilbrush {
namespace {

struct Cause {
  SkipReason reason;
  const char* what;
};

Cause cause_of(Obstruction what) {
  switch (what) {
    case Obstruction::kNone:
      break;
    case Obstruction::kBeamObject:
      return {SkipReason::kOccluded, "beam blocked by the object"};
    case Obstruction::kBeamTable:
      return {SkipReason::kLensTable, "beam blocked by the table"};
    case Obstruction::kLensObject:
      return {SkipReason::kLensObject, "the lens body would touch the object"};
    case Obstruction::kLensTable:
      return {SkipReason::kLensTable, "the lens body would touch the table"};
    case Obstruction::kQuillObject:
      return {SkipReason::kLensObject, "the quill would touch the object"};
    case Obstruction::kQuillTable:
      return {SkipReason::kLensTable, "the quill would touch the table"};
    case Obstruction::kLinkObject:
      return {SkipReason::kArm, "an arm link would touch the object"};
    case Obstruction::kLinkTable:
      return {SkipReason::kArm, "an arm link would touch the table"};
    case Obstruction::kLinkLens:
      return {SkipReason::kArm, "an arm link would touch the lens body"};
    case Obstruction::kColumnObject:
      return {SkipReason::kArm, "the object would touch the robot's column"};
    case Obstruction::kColumnTable:
      return {SkipReason::kArm, "the table would touch the robot's column"};
    case Obstruction::kColumnTool:
      return {SkipReason::kArm, "the arm would touch the robot's column"};
  }
  return {SkipReason::kIncidence, "the face is turned away from every beam"};
}

constexpr std::array<const char*, kAxisCount> kPastLimit{"J1 past its limit",   "J2 past its limit",
                                                         "J3 past its limit",   "J4 past its limit",
                                                         "tilt past its limit", "rotation past its limit"};
constexpr std::array<const char*, kAxisCount> kAxisWords{"J1", "J2", "J3", "J4", "tilt", "rotation"};
constexpr std::string_view kOutOfReach = "out of the arm's reach";

std::string shortfall_mm(double length_m) {
  return amount(length_m * 1e3) + " mm";
}

std::string shortfall_degrees(double angle) {
  return amount(angle / kDegree) + " degrees";
}

}  // namespace

bool FailureTally::replaces(Stage stage, double shortfall) {
  if (stage < stage_ || (stage == stage_ && shortfall >= shortfall_)) return false;
  stage_ = stage;
  shortfall_ = shortfall;
  return true;
}

void FailureTally::body(Stage stage, const Shortfall& shortfall) {
  if (!replaces(stage, shortfall.amount_m)) return;
  what_ = shortfall.what;
  amount_ = shortfall.amount_m;
}

void FailureTally::beam(Obstruction what, double free_m) {
  if (!replaces(kBeam, what == Obstruction::kBeamObject ? -free_m : 1)) return;
  what_ = what;
  amount_ = free_m;
}

void FailureTally::lens(const Shortfall& shortfall) {
  body(kLens, shortfall);
}

void FailureTally::quill(const Shortfall& shortfall) {
  body(kQuill, shortfall);
}

void FailureTally::links(const Shortfall& shortfall) {
  body(kLinks, shortfall);
}

void FailureTally::no_tilt(double excess) {
  if (replaces(kTable, excess)) amount_ = excess;
}

void FailureTally::workspace_boundary(double excess_m) {
  // An arm that is too short fails before any limit: a candidate that fails a limit has passed more checks.
  if (!replaces(kLimit, 10 + excess_m)) return;
  axis_ = kAxisCount;
  amount_ = excess_m;
}

void FailureTally::limit(const LimitExcess& excess) {
  if (!replaces(kLimit, excess.amount)) return;
  axis_ = excess.axis;
  amount_ = excess.amount;
}

bool FailureTally::is_nearly_reached() const {
  // The steps of the second search are 5 degrees of direction and 7.5 of tilt: half of that turns the object,
  // within .2 m of the axis, by less than this.
  constexpr double kLengthM = .02, kAngle = 12 * kDegree;
  // A window that was missed is narrow; a beam that is blocked near the dot is far from any.
  constexpr double kDeepM = .01;
  switch (stage_) {
    case kNone:
    case kTable:
      return true;
    case kBeam:
      return what_ == Obstruction::kBeamTable || amount_ >= kDeepM;
    case kLimit:
      return amount_ <= (axis_ == kJ3 || axis_ == kAxisCount ? kLengthM : kAngle);
    case kLens:
    case kQuill:
    case kLinks:
      return amount_ <= kLengthM;
  }
  return true;
}

SkippedDot FailureTally::describe() const {
  if (stage_ == kTable) return past_limit(SkipReason::kIncidence, kTilt);
  if (stage_ == kLimit) {
    if (axis_ != kAxisCount) return past_limit(SkipReason::kJointLimit, axis_);
    return {0,
            SkipReason::kJointLimit,
            shortfall_mm(amount_) + " " + std::string(kOutOfReach),
            kOutOfReach,
            amount_,
            SkipMeasure::kExcessLength};
  }
  const Cause cause = cause_of(what_);
  SkippedDot skipped{0, cause.reason, cause.what, cause.what, amount_, SkipMeasure::kExcessLength};
  if (stage_ == kBeam) {
    skipped.measure = SkipMeasure::kFreeLength;
    skipped.detail += " " + shortfall_mm(amount_) + " from the dot";
  } else if (stage_ != kNone) {
    skipped.detail += ", " + shortfall_mm(amount_) + " too near";
  }
  return skipped;
}

SkippedDot FailureTally::past_limit(SkipReason reason, std::size_t axis) const {
  const bool is_angle = axis != kJ3;
  const std::string excess = is_angle ? shortfall_degrees(amount_) : shortfall_mm(amount_);
  return {0,
          reason,
          std::string(kAxisWords[axis]) + " " + excess + " past its limit",
          kPastLimit[axis],
          amount_,
          is_angle ? SkipMeasure::kExcessAngle : SkipMeasure::kExcessLength};
}

}  // namespace hilbrush
