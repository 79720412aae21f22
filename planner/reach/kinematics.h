#pragma once
#include <Eigen/Core>

#include "planner/cell_model/cell_description.h"

/// Closed-form kinematics of the cell, in the coordinates that planning searches: tilt A, rotation C, and yaw
/// = J1 + J2
/// + J4. Frames as in cell_description.h. The only singularities are the outer and inner workspace boundary
/// of the arm, which solve_arm refuses.
namespace hilbrush {

/// The table at one (A, C): where the object is.
struct TablePose {
  double tilt = 0, rotation = 0;
  Eigen::Matrix3d R_WO = Eigen::Matrix3d::Identity();
  Eigen::Vector3d origin_W = Eigen::Vector3d::Zero();  ///< of O

  Eigen::Vector3d to_W(const Eigen::Vector3d& p_O) const { return R_WO * p_O + origin_W; }
};

/// The tool as the object sees it.
struct ToolPose {
  Eigen::Vector3d focus_O;
  Eigen::Vector3d beam_O;  ///< unit, from the lens to the focus
  Eigen::Vector3d up_O;    ///< unit, the world's vertical: the quill's axis
};

/// Which way the arm bends: the sign of J2.
enum class Elbow { kPositive, kNegative };

/// By how much joints are outside their limits; of several, the worst relative to the axis's range.
struct LimitExcess {
  std::size_t axis = 0;
  double amount = 0;  ///< rad or m; <= 0: all joints are inside, by at least -amount of this axis

  bool is_inside() const { return amount <= 0; }
};

class Kinematics {
 public:
  explicit Kinematics(const CellDescription& cell);

  TablePose table_pose(double tilt, double rotation) const;
  /// Unit direction of the beam at this yaw.
  Eigen::Vector3d beam_W(double yaw) const;
  ToolPose tool_pose(const TablePose& table, const Eigen::Vector3d& focus_O, double yaw) const;
  /// Forward kinematics.
  ToolPose tool_pose(const Joints& joints) const;
  double yaw(const Joints& joints) const { return joints[kJ1] + joints[kJ2] + joints[kJ4]; }

  /// J1..J4 that bring the focus to `focus_W` at `yaw`; J4 in [-pi, pi]. False if the flange is out of the
  /// arm's annulus; then `boundary_excess_m` (optional) says by how much. Limits are not checked. Accurate to
  /// rounding: forward and inverse kinematics together are off by less than 1e-12 m.
  bool solve_arm(const Eigen::Vector3d& focus_W, double yaw, Elbow elbow, Joints& joints,
                 double* boundary_excess_m = nullptr) const;

  /// How the joints follow the yaw while the focus stays where it is, rad/rad: J1, J2 and J4; zero for the
  /// others. Unbounded at the straight arm.
  Joints per_yaw(const Joints& joints) const;

  /// Against the limits with margin; J2 also keeps clear of the straight arm.
  LimitExcess limit_excess(const Joints& joints) const;
  /// The limits that planning keeps: the cell's, less its margin.
  double axis_min(std::size_t axis) const { return min_[axis]; }
  double axis_max(std::size_t axis) const { return max_[axis]; }

  /// `angle` plus the whole turns that bring it nearest to `reference` within the axis's limits. The angle
  /// itself if none of them is within the limits.
  double unwrap_near(std::size_t axis, double angle, double reference) const;

  double cos_depression() const { return cos_e_; }
  double sin_depression() const { return sin_e_; }
  const CellDescription& cell() const { return cell_; }

 private:
  const CellDescription& cell_;
  double cos_e_, sin_e_;
  std::array<double, kAxisCount> min_{}, max_{};
};

}  // namespace hilbrush
