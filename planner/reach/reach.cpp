#include "planner/reach/reach.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "planner/reach/reach_failure.h"
#include "sampling/base/angles.h"

namespace hilbrush {
namespace {

/// Against rounding of normals to single precision, so that no exposure exceeds the limit by an ulp.
constexpr double kIncidenceGuard = 1e-4;
constexpr double kTiltStep = 7.5 * kDegree, kFineTiltStep = 2.5 * kDegree;

/// Evenly from `first` to `last`, both included, at most `step` apart.
std::vector<double> steps(double first, double last, double step) {
  const int count = std::max(2, static_cast<int>(std::ceil(std::abs(last - first) / step)));
  std::vector<double> values;
  for (int i = 0; i <= count; ++i) values.push_back(first + (last - first) * i / count);
  return values;
}

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

/// By how much the tilt would have to exceed its limits to bring the beam to this direction in O; not above zero if
/// solve_table finds a tilt. In W the beam is at 90 degrees + depression from the vertical, so the table's axis has to
/// be tilted at least by what the beam's angle with that axis differs from it.
double tilt_excess(const Kinematics& kinematics, const Eigen::Vector3d& beam_O) {
  const double from_axis = std::acos(std::clamp(beam_O.z(), -1., 1.));
  const double from_vertical = std::atan2(kinematics.cos_depression(), -kinematics.sin_depression());
  return std::abs(from_axis - from_vertical) -
         std::max(std::abs(kinematics.axis_min(kTilt)), std::abs(kinematics.axis_max(kTilt)));
}

}  // namespace

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
  const double max_incidence = options.max_incidence - kIncidenceGuard;
  cos_max_incidence_ = std::cos(max_incidence);
  cone_ = rings(max_incidence, 5, 9 * kDegree);
  fine_cone_ = rings(max_incidence, 9, 5 * kDegree);
  finest_cone_ = rings(max_incidence, 18, 2.5 * kDegree);
  tilts_ = steps(kinematics.axis_max(kTilt), kinematics.axis_min(kTilt), kTiltStep);
  fine_tilts_ = steps(kinematics.axis_max(kTilt), kinematics.axis_min(kTilt), kFineTiltStep);
}

bool Reach::Implementation::arm_fits(const TablePose& table, const Eigen::Vector3d& position_O, double yaw, Elbow elbow,
                                     const Joints& reference, Joints& joints, FailureTally* tally) const {
  double boundary_excess_m = 0;
  if (!kinematics.solve_arm(table.to_W(position_O), yaw, elbow, joints, &boundary_excess_m)) {
    if (tally) tally->workspace_boundary(boundary_excess_m);
    return false;
  }
  joints[kJ4] = kinematics.unwrap_near(kJ4, joints[kJ4], reference[kJ4]);
  joints[kTilt] = table.tilt;
  joints[kRotation] = table.rotation;
  const LimitExcess excess = kinematics.limit_excess(joints);
  if (!excess.is_inside()) {
    if (tally) tally->limit(excess);
    return false;
  }
  const ToolPose tool = kinematics.tool_pose(table, position_O, yaw);
  if (clearance.quill_obstruction(tool) != Obstruction::kNone) {
    if (tally) tally->quill(clearance.quill_shortfall(tool));
    return false;
  }
  if (clearance.links_obstruction(table, joints) == Obstruction::kNone) return true;
  if (tally) tally->links(clearance.links_shortfall(table, joints));
  return false;
}

std::optional<DotPose> Reach::Implementation::pose_for_beam(const Target& target, const Eigen::Vector3d& beam_O,
                                                            const std::vector<double>& tilts, const Joints& reference,
                                                            FailureTally* tally) const {
  bool has_tilt = false;
  for (const double tilt : tilts) {
    TableSolution solutions[2];
    const int count = solve_table(kinematics, tilt, beam_O, solutions);
    for (int i = 0; i < count; ++i) {
      has_tilt = true;
      DotPose pose;
      pose.table =
          kinematics.table_pose(tilt, kinematics.unwrap_near(kRotation, solutions[i].rotation, reference[kRotation]));
      pose.yaw = solutions[i].yaw;
      for (const Elbow elbow : {Elbow::kPositive, Elbow::kNegative}) {
        if (!arm_fits(pose.table, target.position_O, pose.yaw, elbow, reference, pose.joints, tally)) continue;
        pose.elbow = elbow;
        pose.from_smooth = std::acos(std::clamp(-beam_O.dot(target.smooth_normal_O), -1., 1.));
        return pose;
      }
    }
  }
  if (!has_tilt && tally) tally->no_tilt(tilt_excess(kinematics, beam_O));
  return std::nullopt;
}

bool Reach::Implementation::is_clear(const Target& target, const Eigen::Vector3d& beam_O) const {
  return -beam_O.dot(target.face_normal_O) >= cos_max_incidence_ &&
         clearance.lens_obstruction(target.position_O, beam_O) == Obstruction::kNone &&
         clearance.beam_obstruction(target.position_O, beam_O) == Obstruction::kNone;
}

bool Reach::Implementation::can_hit(const Target& target, const Eigen::Vector3d& beam_O) const {
  if (!is_clear(target, beam_O)) return false;
  const Joints anywhere{};
  return pose_for_beam(target, beam_O, tilts_, anywhere, nullptr) ||
         pose_for_beam(target, beam_O, fine_tilts_, anywhere, nullptr);
}

std::optional<DotPose> Reach::Implementation::search_cone(const Target& target, const Eigen::Vector3d& axis_O,
                                                          const Directions& cone, const std::vector<double>& tilts,
                                                          const Joints& reference, FailureTally* tally) const {
  const Eigen::Vector3d u = axis_O.unitOrthogonal(), v = axis_O.cross(u);
  for (const Eigen::Vector3d& direction : cone) {
    const Eigen::Vector3d beam_O = -(direction.x() * u + direction.y() * v + direction.z() * axis_O);
    if (-beam_O.dot(target.face_normal_O) < cos_max_incidence_ - 1e-9) continue;
    // What no tilt gives need not be clear, unless somebody wants to be told of it.
    if (!tally && tilt_excess(kinematics, beam_O) > 1e-6) continue;
    const Obstruction beam = clearance.beam_obstruction(target.position_O, beam_O);
    if (beam != Obstruction::kNone) {
      if (tally) tally->beam(beam, clearance.beam_free_length_m(target.position_O, beam_O));
      continue;
    }
    if (clearance.lens_obstruction(target.position_O, beam_O) != Obstruction::kNone) {
      if (tally) tally->lens(clearance.lens_shortfall(target.position_O, beam_O));
      continue;
    }
    if (auto pose = pose_for_beam(target, beam_O, tilts, reference, tally)) return pose;
  }
  return std::nullopt;
}

std::optional<DotPose> Reach::Implementation::find_pose_quickly(const Target& target, const Joints& reference) const {
  auto pose = search_cone(target, target.smooth_normal_O, cone_, tilts_, reference, nullptr);
  if (!pose && target.smooth_normal_O.dot(target.face_normal_O) < .999)
    pose = search_cone(target, target.face_normal_O, cone_, tilts_, reference, nullptr);
  return pose;
}

std::optional<DotPose> Reach::Implementation::find_pose(const Target& target, const Joints& reference,
                                                        SkippedDot* skipped) const {
  auto pose = find_pose_quickly(target, reference);
  if (!pose) {
    // Why not, is asked while looking more closely. A third look is for windows that are narrower still: what is clear
    // says nothing of how near they are to the tilts that are possible.
    FailureTally tally;
    pose = search_cone(target, target.face_normal_O, fine_cone_, tilts_, reference, &tally);
    if (!pose && tally.is_nearly_reached())
      pose = search_cone(target, target.face_normal_O, finest_cone_, fine_tilts_, reference, nullptr);
    if (!pose && skipped) tally.tell(*skipped);
  }
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
