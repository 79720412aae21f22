#include "planner/reach.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

namespace hilbrush {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
/// Against rounding of normals to single precision, so that no exposure exceeds the limit by an ulp.
constexpr double kIncidenceGuard = 1e-4;
constexpr double kTiltStep = 7.5 * kDegree;

/// Directions around +z, ring by ring outwards.
std::vector<Eigen::Vector3d> rings(double max_angle, int ring_count, double spacing) {
  std::vector<Eigen::Vector3d> directions{Eigen::Vector3d::UnitZ()};
  for (int ring = 1; ring <= ring_count; ++ring) {
    const double angle = max_angle * ring / ring_count;
    const int count = std::max(4, static_cast<int>(std::ceil(2 * std::numbers::pi * std::sin(angle) / spacing)));
    for (int i = 0; i < count; ++i) {
      const double turn = 2 * std::numbers::pi * (i + .5 * (ring & 1)) / count;
      directions.emplace_back(std::sin(angle) * std::cos(turn), std::sin(angle) * std::sin(turn), std::cos(angle));
    }
  }
  return directions;
}

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2g", value);
  return text;
}

/// Radius of object and table parts around an axis through the origin; `height` lifts O's origin above it.
double radius_around(const TexturedMesh& mesh, const CellDescription& cell, double height, bool around_tilt) {
  const auto along = [&](double r, double z) { return around_tilt ? std::hypot(r, z + height) : r; };
  const double post = cell.fixture.post_height_m;
  double radius = std::max(along(cell.table.plate_radius_m, -post),
                           along(cell.table.plate_radius_m, -post - cell.table.plate_thickness_m));
  for (const auto& p : mesh.vertices) radius = std::max(radius, along(p.head<2>().norm(), p.z()));
  return radius;
}

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
  }
  return "unknown";
}

bool FailureTally::is_better(int stage, double shortfall) {
  if (stage < stage_ || (stage == stage_ && shortfall >= shortfall_)) return false;
  stage_ = stage;
  shortfall_ = shortfall;
  is_quill_ = is_rim_ = false;
  return true;
}

void FailureTally::beam(Obstruction what, double free_m) {
  if (!is_better(0, what == Obstruction::kBeamObject ? -free_m : 1)) return;
  reason_ = what == Obstruction::kBeamObject ? SkipReason::kOccluded : SkipReason::kLensTable;
  length_m_ = free_m;
}

void FailureTally::lens(Obstruction what) {
  if (!is_better(1, 0)) return;
  reason_ = what == Obstruction::kLensTable ? SkipReason::kLensTable : SkipReason::kLensObject;
}

void FailureTally::no_tilt() {
  if (is_better(2, 0)) reason_ = SkipReason::kIncidence;
}

void FailureTally::rim(double excess_m) {
  if (!is_better(3, 10 + excess_m)) return;
  reason_ = SkipReason::kJointLimit;
  is_rim_ = true;
  length_m_ = excess_m;
}

void FailureTally::limit(const LimitExcess& excess) {
  if (!is_better(3, excess.amount)) return;
  reason_ = SkipReason::kJointLimit;
  excess_ = excess;
}

void FailureTally::quill(Obstruction what) {
  if (!is_better(4, 0)) return;
  reason_ = what == Obstruction::kLensTable ? SkipReason::kLensTable : SkipReason::kLensObject;
  is_quill_ = true;
}

void FailureTally::tell(SkippedDot& skipped) const {
  skipped.reason = reason_;
  switch (reason_) {
    case SkipReason::kOccluded:
      skipped.detail = "beam blocked by the object " + number(length_m_ * 1e3) + " mm from the dot";
      break;
    case SkipReason::kLensObject:
    case SkipReason::kLensTable:
      skipped.detail = stage_ == 0 ? "beam blocked by the table" : is_quill_ ? "the quill" : "the lens body";
      if (stage_ > 0)
        skipped.detail += reason_ == SkipReason::kLensTable ? " would touch the table" : " would touch the object";
      break;
    case SkipReason::kJointLimit: {
      if (is_rim_) {
        skipped.detail = number(length_m_ * 1e3) + " mm out of the arm's reach";
        break;
      }
      const bool is_length = excess_.axis == kJ3;
      std::string axis = kAxisNames[static_cast<std::size_t>(excess_.axis)];
      axis[0] = static_cast<char>(axis[0] - 'a' + 'A');
      skipped.detail = axis + " " + number(is_length ? excess_.amount * 1e3 : excess_.amount / kDegree) +
                       (is_length ? " mm" : " degrees") + " past its limit";
      break;
    }
    case SkipReason::kIncidence:
      skipped.detail = "no tilt of the table turns the dot towards the beam";
      break;
    case SkipReason::kEnergy:
      break;
  }
}

int solve_table(const Kinematics& kinematics, double tilt, const Eigen::Vector3d& beam_O, TableSolution* solutions) {
  const double ce = kinematics.cos_depression(), se = kinematics.sin_depression();
  const double ca = std::cos(tilt), sa = std::sin(tilt);
  if (std::abs(sa * ce) < 1e-4) return 0;  // A = 0: C is parallel to yaw, no yaw changes the height of the beam
  const double cos_yaw = -(beam_O.z() + ca * se) / (sa * ce);
  if (std::abs(cos_yaw) > 1) return 0;
  const double azimuth_O = std::atan2(beam_O.y(), beam_O.x());
  const double yaw = std::acos(cos_yaw);
  for (int i = 0; i < 2; ++i) {
    const double signed_yaw = i == 0 ? yaw : -yaw;
    const double x = ca * ce * cos_yaw - sa * se, y = ce * std::sin(signed_yaw);
    solutions[i] = {signed_yaw, std::remainder(std::atan2(y, x) - azimuth_O, 2 * std::numbers::pi)};
  }
  return 2;
}

Reach::Implementation::Implementation(const TexturedMesh& mesh, const CellDescription& cell_description,
                                      const PlanOptions& plan_options)
    : cell(cell_description), options(plan_options), kinematics(cell), clearance(mesh, cell) {
  const double height = cell.table.plate_height_m + cell.fixture.post_height_m;
  object_radius_m = radius_around(mesh, cell, height, true);
  object_turn_m = radius_around(mesh, cell, height, false);
  const double max_incidence = options.max_incidence - kIncidenceGuard;
  cos_max_incidence_ = std::cos(max_incidence);
  cone_ = rings(max_incidence, 5, 9 * kDegree);
  fine_cone_ = rings(max_incidence, 9, 5 * kDegree);
  const int tilt_count =
      std::max(2, static_cast<int>(std::ceil((kinematics.axis_max(kTilt) - kinematics.axis_min(kTilt)) / kTiltStep)));
  for (int i = 0; i <= tilt_count; ++i)
    tilts_.push_back(kinematics.axis_max(kTilt) -
                     (kinematics.axis_max(kTilt) - kinematics.axis_min(kTilt)) * i / tilt_count);
}

bool Reach::Implementation::arm_fits(const TablePose& table, const Eigen::Vector3d& position_O, double yaw, Elbow elbow,
                                     const Joints& reference, Joints& joints, FailureTally* tally) const {
  double rim_excess_m = 0;
  if (!kinematics.solve_arm(table.to_W(position_O), yaw, elbow, joints, &rim_excess_m)) {
    if (tally) tally->rim(rim_excess_m);
    return false;
  }
  joints[kJ4] = kinematics.wind(kJ4, joints[kJ4], reference[kJ4]);
  joints[kTilt] = table.tilt;
  joints[kRotation] = table.rotation;
  const LimitExcess excess = kinematics.limit_excess(joints);
  if (!excess.is_inside()) {
    if (tally) tally->limit(excess);
    return false;
  }
  const Obstruction quill = clearance.quill_obstruction(kinematics.tool_pose(table, position_O, yaw));
  if (quill == Obstruction::kNone) return true;
  if (tally) tally->quill(quill);
  return false;
}

std::optional<DotPose> Reach::Implementation::pose_for_beam(const Target& target, const Eigen::Vector3d& beam_O,
                                                            const Joints& reference, FailureTally* tally) const {
  bool has_tilt = false;
  for (const double tilt : tilts_) {
    TableSolution solutions[2];
    const int count = solve_table(kinematics, tilt, beam_O, solutions);
    for (int i = 0; i < count; ++i) {
      has_tilt = true;
      DotPose pose;
      pose.table = kinematics.table_pose(tilt, kinematics.wind(kRotation, solutions[i].rotation, reference[kRotation]));
      pose.yaw = solutions[i].yaw;
      for (const Elbow elbow : {Elbow::kPositive, Elbow::kNegative}) {
        if (!arm_fits(pose.table, target.position_O, pose.yaw, elbow, reference, pose.joints, tally)) continue;
        pose.elbow = elbow;
        pose.from_smooth = std::acos(std::clamp(-beam_O.dot(target.smooth_normal_O), -1., 1.));
        return pose;
      }
    }
  }
  if (!has_tilt && tally) tally->no_tilt();
  return std::nullopt;
}

std::optional<DotPose> Reach::Implementation::find_pose(const Target& target, const Joints& reference,
                                                        SkippedDot* skipped) const {
  FailureTally tally;
  const auto search = [&](const std::vector<Eigen::Vector3d>& cone,
                          const Eigen::Vector3d& axis_O) -> std::optional<DotPose> {
    const Eigen::Vector3d u = axis_O.unitOrthogonal(), v = axis_O.cross(u);
    for (const Eigen::Vector3d& direction : cone) {
      const Eigen::Vector3d beam_O = -(direction.x() * u + direction.y() * v + direction.z() * axis_O);
      if (-beam_O.dot(target.face_normal_O) < cos_max_incidence_ - 1e-9) continue;
      const Obstruction beam = clearance.beam_obstruction(target.position_O, beam_O);
      if (beam != Obstruction::kNone) {
        if (skipped) tally.beam(beam, clearance.beam_free_length_m(target.position_O, beam_O));
        continue;
      }
      const Obstruction lens = clearance.lens_obstruction(target.position_O, beam_O);
      if (lens != Obstruction::kNone) {
        tally.lens(lens);
        continue;
      }
      if (auto pose = pose_for_beam(target, beam_O, reference, skipped ? &tally : nullptr)) return pose;
    }
    return std::nullopt;
  };
  auto pose = search(cone_, target.smooth_normal_O);
  if (!pose && target.smooth_normal_O.dot(target.face_normal_O) < .999) pose = search(cone_, target.face_normal_O);
  if (!pose) pose = search(fine_cone_, target.face_normal_O);
  if (!pose && skipped) tally.tell(*skipped);
  return pose;
}

Reach::Reach(const TexturedMesh& mesh, const CellDescription& cell, const PlanOptions& options)
    : implementation_(std::make_unique<Implementation>(mesh, cell, options)) {}
Reach::~Reach() = default;
Reach::Reach(Reach&&) noexcept = default;

bool Reach::is_reachable(const Eigen::Vector3d& position_O, const Eigen::Vector3d& normal_O,
                         SkippedDot* skipped) const {
  return implementation_->find_pose({position_O, normal_O, normal_O}, {}, skipped).has_value();
}

}  // namespace hilbrush
