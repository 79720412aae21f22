#pragma once
#include <Eigen/Core>
#include <array>

#include "planner/cell_description.h"
#include "planner/kinematics.h"

/// Where the arm's two links are: capsules at fixed heights, over which J1 and J2 turn and through which the quill
/// slides.
namespace hilbrush {

struct Capsule {
  Eigen::Vector3d from, to;
  double radius_m = 0;  ///< 0: there is none

  Capsule in_O(const TablePose& table) const {
    const auto to_O = [&](const Eigen::Vector3d& p_W) -> Eigen::Vector3d {
      return table.R_WO.transpose() * (p_W - table.origin_W);
    };
    return {to_O(from), to_O(to), radius_m};
  }
};

/// Upper arm and forearm, in W.
std::array<Capsule, 2> arm_links_W(const CellDescription::Arm& arm, const Joints& joints);

/// The lens, in W: the capsule that holds its cylinder.
Capsule lens_capsule_W(const CellDescription& cell, const Joints& joints);

/// Between the surfaces; negative if they overlap.
double capsule_gap_m(const Capsule& a, const Capsule& b);

}  // namespace hilbrush
