#include "planner/reach/kinematics.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sampling/base/angles.h"

namespace hilbrush {
namespace {

/// The straight arm is singular: J1 and J2 would have to move very fast for a small move along the arm.
constexpr double kStraightGuard = kTurn / 120;  // 3 degrees

double wrapped(double angle) {
  return std::remainder(angle, kTurn);
}

}  // namespace

Kinematics::Kinematics(const CellDescription& cell)
    : cell_(cell), cos_e_(std::cos(cell.arm.beam_depression)), sin_e_(std::sin(cell.arm.beam_depression)) {
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const double margin = cell.limit_margin * (cell.axes[i].max - cell.axes[i].min);
    min_[i] = cell.axes[i].min + margin;
    max_[i] = cell.axes[i].max - margin;
  }
}

TablePose Kinematics::table_pose(double tilt, double rotation) const {
  const double ca = std::cos(tilt);
  const double sa = std::sin(tilt);
  const double cc = std::cos(rotation);
  const double sc = std::sin(rotation);
  TablePose pose;
  pose.tilt = tilt;
  pose.rotation = rotation;
  // Ry(-A) Rz(C)
  pose.R_WO << ca * cc, -ca * sc, -sa,  //
      sc, cc, 0,                        //
      sa * cc, -sa * sc, ca;
  const double height = cell_.table.plate_height_m + cell_.fixture.post_height_m;
  pose.origin_W = cell_.table.tilt_axis_W + height * pose.R_WO.col(2);
  return pose;
}

Eigen::Vector3d Kinematics::beam_W(double yaw) const {
  return {cos_e_ * std::cos(yaw), cos_e_ * std::sin(yaw), -sin_e_};
}

ToolPose Kinematics::tool_pose(const TablePose& table, const Eigen::Vector3d& focus_O, double yaw) const {
  return {focus_O, table.R_WO.transpose() * beam_W(yaw), table.R_WO.row(2).transpose()};
}

ToolPose Kinematics::tool_pose(const Joints& joints) const {
  const TablePose table = table_pose(joints[kTilt], joints[kRotation]);
  const double forearm_angle = joints[kJ1] + joints[kJ2];
  const auto& arm = cell_.arm;
  const Eigen::Vector3d flange_W(
      arm.upper_arm_m * std::cos(joints[kJ1]) + arm.forearm_m * std::cos(forearm_angle),
      arm.upper_arm_m * std::sin(joints[kJ1]) + arm.forearm_m * std::sin(forearm_angle), joints[kJ3]);
  const double tool_yaw = yaw(joints);
  const Eigen::Vector3d focus_W = flange_W + arm.flange_to_focus_m * beam_W(tool_yaw);
  return tool_pose(table, table.R_WO.transpose() * (focus_W - table.origin_W), tool_yaw);
}

bool Kinematics::solve_arm(const Eigen::Vector3d& focus_W, double yaw, Elbow elbow, Joints& joints,
                           double* boundary_excess_m) const {
  const auto& arm = cell_.arm;
  const Eigen::Vector3d flange_W = focus_W - arm.flange_to_focus_m * beam_W(yaw);
  const double distance2 = flange_W.head<2>().squaredNorm();
  const double l1 = arm.upper_arm_m;
  const double l2 = arm.forearm_m;
  const double cos_j2 = (distance2 - l1 * l1 - l2 * l2) / (2 * l1 * l2);
  if (!(std::abs(cos_j2) < 1)) {
    if (boundary_excess_m) {
      const double distance = std::sqrt(distance2);
      *boundary_excess_m = std::max(distance - (l1 + l2), std::abs(l1 - l2) - distance);
    }
    return false;
  }
  // sin^2 as a product keeps its digits near the straight arm.
  const double sin_j2 = (elbow == Elbow::kPositive ? 1 : -1) * std::sqrt((1 - cos_j2) * (1 + cos_j2));
  joints[kJ2] = std::atan2(sin_j2, cos_j2);
  joints[kJ1] = wrapped(std::atan2(flange_W.y(), flange_W.x()) - std::atan2(l2 * sin_j2, l1 + l2 * cos_j2));
  joints[kJ3] = flange_W.z();
  joints[kJ4] = wrapped(yaw - joints[kJ1] - joints[kJ2]);
  return true;
}

Joints Kinematics::per_yaw(const Joints& joints) const {
  const double forearm_angle = joints[kJ1] + joints[kJ2];
  const double tool_yaw = yaw(joints);
  // The flange circles around the focus.
  const Eigen::Vector2d flange_W =
      cell_.arm.flange_to_focus_m * cos_e_ * Eigen::Vector2d(std::sin(tool_yaw), -std::cos(tool_yaw));
  const Eigen::Vector2d upper(std::cos(joints[kJ1]), std::sin(joints[kJ1]));
  const Eigen::Vector2d fore(std::cos(forearm_angle), std::sin(forearm_angle));
  const double sin_j2 = std::sin(joints[kJ2]);
  const double j1 = flange_W.dot(fore) / (cell_.arm.upper_arm_m * sin_j2);
  const double forearm = -flange_W.dot(upper) / (cell_.arm.forearm_m * sin_j2);
  return {j1, forearm - j1, 0, 1 - forearm, 0, 0};
}

LimitExcess Kinematics::limit_excess(const Joints& joints) const {
  LimitExcess worst{0, -std::numeric_limits<double>::infinity()};
  double worst_share = -std::numeric_limits<double>::infinity();
  const auto consider = [&](std::size_t axis, double amount) {
    const double share = amount / (axis_max(axis) - axis_min(axis));
    if (share <= worst_share) return;
    worst = {axis, amount};
    worst_share = share;
  };
  for (std::size_t axis = 0; axis < kAxisCount; ++axis)
    consider(axis, std::max(joints[axis] - axis_max(axis), axis_min(axis) - joints[axis]));
  consider(kJ2, kStraightGuard - std::abs(joints[kJ2]));
  return worst;
}

double Kinematics::unwrap_near(std::size_t axis, double angle, double reference) const {
  const double low = axis_min(axis);
  const double high = axis_max(axis);
  const double nearest = angle + kTurn * std::round((reference - angle) / kTurn);
  if (nearest >= low && nearest <= high) return nearest;
  const double unwrapped = nearest > high ? angle + kTurn * std::floor((high - angle) / kTurn)
                                          : angle + kTurn * std::ceil((low - angle) / kTurn);
  return unwrapped >= low && unwrapped <= high ? unwrapped : angle;
}

}  // namespace hilbrush
