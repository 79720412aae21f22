#include "planner/poses/follow_normal.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "planner/cell_model/time_model.h"
#include "sampling/base/angles.h"

namespace hilbrush {
namespace {

constexpr double kRingStep = kTurn / 120;  // 3 degrees, between the beams off the normal that are tried

class NormalFollower {
 public:
  explicit NormalFollower(const Reach& reach) : reach_(reach), now_(home_joints(reach.cell())) {
    const double max_incidence = reach.options().max_incidence;
    const int ring_count = std::max(1, static_cast<int>(std::ceil(max_incidence / kRingStep)));
    cone_.push_back(Eigen::Vector3d::UnitZ());
    for (int ring = 1; ring <= ring_count; ++ring) {
      const double angle = max_incidence * ring / ring_count;
      const int count = 6 * ring;
      for (int i = 0; i < count; ++i) {
        const double turn = kTurn * i / count;
        cone_.emplace_back(std::sin(angle) * std::cos(turn), std::sin(angle) * std::sin(turn),
                           std::cos(angle));
      }
    }
  }

  std::optional<Joints> next(const Target& target) {
    const Eigen::Vector3d& axis_O = target.smooth_normal_O;
    const Eigen::Vector3d u = axis_O.unitOrthogonal();
    const Eigen::Vector3d v = axis_O.cross(u);
    for (const Eigen::Vector3d& direction : cone_) {
      const Eigen::Vector3d beam_O = -(direction.x() * u + direction.y() * v + direction.z() * axis_O);
      if (-beam_O.dot(target.face_normal_O) < reach_.cos_max_incidence()) continue;
      if (reach_.clearance().lens_obstruction(target.position_O, beam_O) != Obstruction::kNone ||
          reach_.clearance().beam_obstruction(target.position_O, beam_O) != Obstruction::kNone)
        continue;
      if (const auto joints = soonest(target.position_O, beam_O)) {
        now_ = *joints;
        return now_;
      }
    }
    return std::nullopt;
  }

 private:
  /// Tilts worth trying: those that keep the yaw, the present one, and all others on a grid.
  std::vector<double> tilts(const Eigen::Vector3d& beam_O) const {
    const auto& kinematics = reach_.kinematics();
    std::vector<double> tilts{now_[kTilt]};
    const double along = kinematics.cos_depression() * std::cos(kinematics.yaw(now_));
    const double reach = std::hypot(kinematics.sin_depression(), along);
    if (std::abs(beam_O.z()) < reach) {
      const double middle = std::atan2(along, kinematics.sin_depression());
      const double half = std::acos(-beam_O.z() / reach);
      for (const double tilt : {middle - half, middle + half})
        tilts.push_back(
            std::clamp(std::remainder(tilt, kTurn), kinematics.axis_min(kTilt), kinematics.axis_max(kTilt)));
    }
    tilts.insert(tilts.end(), reach_.tilts().begin(), reach_.tilts().end());
    return tilts;
  }

  std::optional<Joints> soonest(const Eigen::Vector3d& position_O, const Eigen::Vector3d& beam_O) const {
    std::optional<Joints> best;
    double best_s = 0;
    for (const double tilt : tilts(beam_O)) {
      for (const TableSolution& solution : solve_table(reach_.kinematics(), tilt, beam_O)) {
        const double rotation =
            reach_.kinematics().unwrap_near(kRotation, solution.rotation, now_[kRotation]);
        const TablePose table = reach_.kinematics().table_pose(tilt, rotation);
        for (const Elbow elbow : {Elbow::kPositive, Elbow::kNegative}) {
          const auto joints = reach_.arm_joints(table, position_O, solution.yaw, elbow, now_);
          if (!joints) continue;
          const bool is_flip = ((*joints)[kJ2] >= 0) != (now_[kJ2] >= 0);
          const double needed_s =
              step_s(reach_.cell(), now_, *joints) + (is_flip ? 2 * reach_.cell().timing.retract_s : 0);
          if (best && needed_s >= best_s) continue;
          best = joints;
          best_s = needed_s;
        }
      }
    }
    return best;
  }

  const Reach& reach_;
  std::vector<Eigen::Vector3d> cone_;  // unit, around +z, nearest first
  Joints now_;
};

}  // namespace

PosedDots follow_normal(const Reach& reach, const DotSequence& dots,
                        std::span<const std::uint32_t> dot_indices, const Progress& progress) {
  NormalFollower follower(reach);
  PosedDots posed;
  posed.sequence.reserve(dot_indices.size());
  Joints now = home_joints(reach.cell());
  for (std::size_t i = 0; i < dot_indices.size(); ++i) {
    const Target target = target_of(dots.dots[dot_indices[i]]);
    auto joints = follower.next(target);
    SkippedDot skipped;
    if (!joints) {
      PoseSearchResult found = reach.find_pose(target, now);
      if (found.pose) joints = found.pose->joints;
      skipped = std::move(found.skipped);
    }
    if (joints) {
      now = *joints;
      posed.sequence.push_back({dot_indices[i], now});
    } else {
      skipped.dot_index = dot_indices[i];
      posed.skipped.push_back(std::move(skipped));
    }
    if (i % 512 == 0) progress.step(i, dot_indices.size());
  }
  return posed;
}

}  // namespace hilbrush
