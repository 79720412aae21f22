#include "planner/reach/reach_failure.h"

#include <array>
#include <cstdio>

#include "sampling/base/angles.h"

namespace hilbrush {
namespace {

/// Two digits, and all of those before the point.
std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, value < 10 ? "%.2g" : "%.0f", value);
  return text;
}

struct Excuse {
  SkipReason reason;
  const char* what;
};

Excuse excuse_of(Obstruction what) {
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

}  // namespace

const char* skip_reason_name(SkipReason reason) {
  switch (reason) {
    case SkipReason::kOccluded:
      return "occluded";
    case SkipReason::kIncidence:
      return "incidence";
    case SkipReason::kJointLimit:
      return "joint_limit";
    case SkipReason::kLensObject:
      return "lens_object";
    case SkipReason::kLensTable:
      return "lens_table";
    case SkipReason::kEnergy:
      return "energy";
    case SkipReason::kArm:
      return "arm";
    case SkipReason::kNoWay:
      return "no_way";
  }
  return "unknown";
}

bool FailureTally::is_better(Stage stage, double shortfall) {
  if (stage < stage_ || (stage == stage_ && shortfall >= shortfall_)) return false;
  stage_ = stage;
  shortfall_ = shortfall;
  return true;
}

void FailureTally::body(Stage stage, const Shortfall& shortfall) {
  if (!is_better(stage, shortfall.amount_m)) return;
  what_ = shortfall.what;
  amount_ = shortfall.amount_m;
}

void FailureTally::beam(Obstruction what, double free_m) {
  if (!is_better(kBeam, what == Obstruction::kBeamObject ? -free_m : 1)) return;
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
  if (is_better(kTable, excess)) amount_ = excess;
}

void FailureTally::workspace_boundary(double excess_m) {
  // An arm that is too short fails before any limit: whoever fails a limit came farther.
  if (is_better(kLimit, 10 + excess_m)) axis_ = kAxisCount, amount_ = excess_m;
}

void FailureTally::limit(const LimitExcess& excess) {
  if (is_better(kLimit, excess.amount)) axis_ = excess.axis, amount_ = excess.amount;
}

bool FailureTally::is_nearly_reached() const {
  // The second look's steps are 5 degrees of direction and 7.5 of tilt: half of that turns the object, within .2 m of
  // the axis, by less than this.
  constexpr double kLengthM = .02, kAngle = 12 * kDegree;
  // A window that is missed is narrow; a beam that is blocked near the dot is nowhere near one.
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

void FailureTally::tell(SkippedDot& skipped) const {
  const auto millimeters = [this] { return number(amount_ * 1e3) + " mm"; };
  const auto degrees = [this] { return number(amount_ / kDegree) + " degrees"; };
  skipped.amount = amount_;
  skipped.is_angle = false;
  if (stage_ == kTable) {
    skipped.reason = SkipReason::kIncidence;
    skipped.what = kPastLimit[kTilt];
    skipped.is_angle = true;
    skipped.detail = std::string(kAxisWords[kTilt]) + " " + degrees() + " past its limit";
  } else if (stage_ == kLimit) {
    skipped.reason = SkipReason::kJointLimit;
    if (axis_ == kAxisCount) {
      skipped.what = "out of the arm's reach";
      skipped.detail = millimeters() + " out of the arm's reach";
      return;
    }
    const auto axis = static_cast<std::size_t>(axis_);
    skipped.what = kPastLimit[axis];
    skipped.is_angle = axis_ != kJ3;
    skipped.detail =
        std::string(kAxisWords[axis]) + " " + (skipped.is_angle ? degrees() : millimeters()) + " past its limit";
  } else {
    const Excuse excuse = excuse_of(what_);
    skipped.reason = excuse.reason;
    skipped.what = excuse.what;
    skipped.detail = excuse.what;
    if (stage_ == kBeam) skipped.detail += " " + millimeters() + " from the dot";
    if (stage_ > kLimit || stage_ == kLens) skipped.detail += ", " + millimeters() + " too near";
  }
}

}  // namespace hilbrush
