#pragma once
#include <cmath>
#include <cstddef>

#include "planner/reach/reach.h"
#include "sampling/base/angles.h"

/// Brute force: every pose of a grid over tilt, rotation and yaw with either elbow, checked by the same rules
/// as planning's but found by another method. Confirms that dots which reach skips are out of reach.
namespace hilbrush {

struct PoseGridAnswer {
  bool is_reached = false;
  std::size_t poses = 0;  ///< within the cone
};

inline PoseGridAnswer search_pose_grid(const Reach& reach, const Target& target, double step) {
  const auto& kinematics = reach.kinematics();
  PoseGridAnswer answer;
  const int turns = static_cast<int>(std::ceil(kTurn / step));
  const double low = kinematics.axis_min(kTilt), high = kinematics.axis_max(kTilt);
  const int tilts = static_cast<int>(std::ceil((high - low) / step));
  const Joints reference{};
  for (int a = 0; a <= tilts; ++a)
    for (int c = 0; c < turns; ++c) {
      const double rotation = std::remainder(c * kTurn / turns, kTurn);
      const TablePose table = kinematics.table_pose(
          low + (high - low) * a / tilts, kinematics.unwrap_near(kRotation, rotation, reference[kRotation]));
      for (int y = 0; y < turns; ++y) {
        const double yaw = y * kTurn / turns;
        const Eigen::Vector3d beam_O = table.R_WO.transpose() * kinematics.beam_W(yaw);
        if (-beam_O.dot(target.face_normal_O) < reach.cos_max_incidence()) continue;
        ++answer.poses;
        const auto fits = [&](Elbow elbow) {
          return reach.arm_joints(table, target.position_O, yaw, elbow, reference).has_value();
        };
        if (reach.clearance().beam_obstruction(target.position_O, beam_O) != Obstruction::kNone ||
            reach.clearance().lens_obstruction(target.position_O, beam_O) != Obstruction::kNone)
          continue;
        if (!fits(Elbow::kPositive) && !fits(Elbow::kNegative)) continue;
        answer.is_reached = true;
        return answer;
      }
    }
  return answer;
}

}  // namespace hilbrush
