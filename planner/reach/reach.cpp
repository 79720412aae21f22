#include "planner/reach/reach.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "planner/reach/reach_failure.h"
#include "sampling/base/angles.h"

namespace hilbrush {
namespace {

/// rad: covers the rounding of normals to single precision, so that no exposure exceeds the limit by an ulp.
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
    const int count =
        std::max(4, static_cast<int>(std::ceil(2 * std::numbers::pi * std::sin(angle) / spacing)));
    for (int i = 0; i < count; ++i) {
      const double turn = 2 * std::numbers::pi * (i + .5 * (ring & 1)) / count;
      directions.emplace_back(std::sin(angle) * std::cos(turn), std::sin(angle) * std::sin(turn),
                              std::cos(angle));
    }
  }
  return directions;
}

/// By how much the tilt would have to exceed its limits to bring the beam to this direction in O; not above
/// zero if solve_table finds a tilt. In W the beam is at 90 degrees + depression from the vertical, so the
/// table's axis has to be tilted at least by what the beam's angle with that axis differs from it.
double tilt_excess(const Kinematics& kinematics, const Eigen::Vector3d& beam_O) {
  const double from_axis = std::acos(std::clamp(beam_O.z(), -1., 1.));
  const double from_vertical = std::atan2(kinematics.cos_depression(), -kinematics.sin_depression());
  return std::abs(from_axis - from_vertical) -
         std::max(std::abs(kinematics.axis_min(kTilt)), std::abs(kinematics.axis_max(kTilt)));
}

}  // namespace

TableSolutions solve_table(const Kinematics& kinematics, double tilt, const Eigen::Vector3d& beam_O) {
  const double ce = kinematics.cos_depression();
  const double se = kinematics.sin_depression();
  const double ca = std::cos(tilt);
  const double sa = std::sin(tilt);
  if (std::abs(sa * ce) < 1e-4)
    return {};  // A = 0: C is parallel to yaw, no yaw changes the height of the beam
  const double cos_yaw = -(beam_O.z() + ca * se) / (sa * ce);
  if (std::abs(cos_yaw) > 1) return {};
  const double azimuth_O = std::atan2(beam_O.y(), beam_O.x());
  const auto solution = [&](double yaw) -> TableSolution {
    const double x = ca * ce * cos_yaw - sa * se;
    const double y = ce * std::sin(yaw);
    return {yaw, std::remainder(std::atan2(y, x) - azimuth_O, kTurn)};
  };
  const double yaw = std::acos(cos_yaw);
  return TableSolutions({solution(yaw), solution(-yaw)});
}

Reach::Reach(const TexturedMesh& mesh, const CellDescription& cell, const PlanOptions& options)
    : cell_(cell), options_(options), kinematics_(cell_), clearance_(mesh, cell_) {
  const double max_incidence = options_.max_incidence - kIncidenceGuard;
  cos_max_incidence_ = std::cos(max_incidence);
  cone_ = rings(max_incidence, 5, 9 * kDegree);
  fine_cone_ = rings(max_incidence, 9, 5 * kDegree);
  finest_cone_ = rings(max_incidence, 18, 2.5 * kDegree);
  tilts_ = steps(kinematics_.axis_max(kTilt), kinematics_.axis_min(kTilt), kTiltStep);
  fine_tilts_ = steps(kinematics_.axis_max(kTilt), kinematics_.axis_min(kTilt), kFineTiltStep);
}

std::optional<Joints> Reach::arm_joints(const TablePose& table, const Eigen::Vector3d& position_O, double yaw,
                                        Elbow elbow, const Joints& reference, FailureTally* tally) const {
  Joints joints{};
  double boundary_excess_m = 0;
  if (!kinematics_.solve_arm(table.to_W(position_O), yaw, elbow, joints, &boundary_excess_m)) {
    if (tally) tally->workspace_boundary(boundary_excess_m);
    return std::nullopt;
  }
  joints[kJ4] = kinematics_.unwrap_near(kJ4, joints[kJ4], reference[kJ4]);
  joints[kTilt] = table.tilt;
  joints[kRotation] = table.rotation;
  const LimitExcess excess = kinematics_.limit_excess(joints);
  if (!excess.is_inside()) {
    if (tally) tally->limit(excess);
    return std::nullopt;
  }
  const ToolPose tool = kinematics_.tool_pose(table, position_O, yaw);
  if (clearance_.quill_obstruction(tool) != Obstruction::kNone) {
    if (tally) tally->quill(clearance_.quill_shortfall(tool));
    return std::nullopt;
  }
  if (clearance_.links_obstruction(table, joints) == Obstruction::kNone) return joints;
  if (tally) tally->links(clearance_.links_shortfall(table, joints));
  return std::nullopt;
}

std::optional<DotPose> Reach::pose_for_beam(const Target& target, const Eigen::Vector3d& beam_O,
                                            const std::vector<double>& tilts, const Joints& reference,
                                            FailureTally* tally) const {
  bool has_tilt = false;
  for (const double tilt : tilts) {
    for (const TableSolution& solution : solve_table(kinematics_, tilt, beam_O)) {
      has_tilt = true;
      const TablePose table = kinematics_.table_pose(
          tilt, kinematics_.unwrap_near(kRotation, solution.rotation, reference[kRotation]));
      for (const Elbow elbow : {Elbow::kPositive, Elbow::kNegative}) {
        const auto joints = arm_joints(table, target.position_O, solution.yaw, elbow, reference, tally);
        if (!joints) continue;
        const double from_smooth = std::acos(std::clamp(-beam_O.dot(target.smooth_normal_O), -1., 1.));
        return DotPose{table, solution.yaw, elbow, *joints, from_smooth};
      }
    }
  }
  if (!has_tilt && tally) tally->no_tilt(tilt_excess(kinematics_, beam_O));
  return std::nullopt;
}

bool Reach::is_clear(const Target& target, const Eigen::Vector3d& beam_O) const {
  return -beam_O.dot(target.face_normal_O) >= cos_max_incidence_ &&
         clearance_.lens_obstruction(target.position_O, beam_O) == Obstruction::kNone &&
         clearance_.beam_obstruction(target.position_O, beam_O) == Obstruction::kNone;
}

bool Reach::can_hit(const Target& target, const Eigen::Vector3d& beam_O) const {
  if (!is_clear(target, beam_O)) return false;
  const Joints anywhere{};
  return pose_for_beam(target, beam_O, tilts_, anywhere, nullptr) ||
         pose_for_beam(target, beam_O, fine_tilts_, anywhere, nullptr);
}

std::optional<DotPose> Reach::search_cone(const Target& target, const Eigen::Vector3d& axis_O,
                                          const Directions& cone, const std::vector<double>& tilts,
                                          const Joints& reference, FailureTally* tally) const {
  const Eigen::Vector3d u = axis_O.unitOrthogonal();
  const Eigen::Vector3d v = axis_O.cross(u);
  for (const Eigen::Vector3d& direction : cone) {
    const Eigen::Vector3d beam_O = -(direction.x() * u + direction.y() * v + direction.z() * axis_O);
    if (-beam_O.dot(target.face_normal_O) < cos_max_incidence_ - 1e-9) continue;
    // Without a tally, beams that no tilt gives need no clearance test.
    if (!tally && tilt_excess(kinematics_, beam_O) > 1e-6) continue;
    const Obstruction beam = clearance_.beam_obstruction(target.position_O, beam_O);
    if (beam != Obstruction::kNone) {
      if (tally) tally->beam(beam, clearance_.beam_free_length_m(target.position_O, beam_O));
      continue;
    }
    if (clearance_.lens_obstruction(target.position_O, beam_O) != Obstruction::kNone) {
      if (tally) tally->lens(clearance_.lens_shortfall(target.position_O, beam_O));
      continue;
    }
    if (auto pose = pose_for_beam(target, beam_O, tilts, reference, tally)) return pose;
  }
  return std::nullopt;
}

std::optional<DotPose> Reach::find_pose_quickly(const Target& target, const Joints& reference) const {
  auto pose = search_cone(target, target.smooth_normal_O, cone_, tilts_, reference, nullptr);
  if (!pose && target.smooth_normal_O.dot(target.face_normal_O) < .999)
    pose = search_cone(target, target.face_normal_O, cone_, tilts_, reference, nullptr);
  return pose;
}

PoseSearchResult Reach::find_pose(const Target& target, const Joints& reference) const {
  if (auto pose = find_pose_quickly(target, reference)) return {std::move(pose), {}};
  // The second, finer search also finds the reason. A third one is for windows that are narrower still, and
  // only where the best failure is a near miss.
  FailureTally tally;
  auto pose = search_cone(target, target.face_normal_O, fine_cone_, tilts_, reference, &tally);
  if (!pose && tally.is_nearly_reached())
    pose = search_cone(target, target.face_normal_O, finest_cone_, fine_tilts_, reference, nullptr);
  if (pose) return {std::move(pose), {}};
  return {std::nullopt, tally.describe()};
}

bool Reach::is_reachable(const Eigen::Vector3d& position_O, const Eigen::Vector3d& normal_O) const {
  return find_pose({position_O, normal_O, normal_O}, {}).pose.has_value();
}

}  // namespace hilbrush
