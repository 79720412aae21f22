#pragma once
#include <Eigen/Core>
#include <array>

#include "planner/cell_model/cell_description.h"
#include "planner/reach/kinematics.h"

/// The shape of the arm: two links, capsules at fixed heights, turned by J1 and J2, through which the quill
/// slides; lens and quill; and the column that the arm stands on.
namespace hilbrush {

struct Capsule {
  Eigen::Vector3d from, to;
  double radius_m = 0;  ///< 0: no such body

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

/// The quill, in W: the capsule that holds its cylinder.
Capsule quill_capsule_W(const CellDescription::Arm& arm, const Joints& joints);

/// The robot's column, in W: the capsule that holds its cylinder.
Capsule column_capsule_W(const CellDescription::Arm& arm);

/// Between the column, which has a flat top, and a capsule beside or above it: a lower bound, exact beside
/// it.
double column_gap_m(const CellDescription::Arm& arm, const Capsule& body);

/// Between the surfaces; negative if they overlap.
double capsule_gap_m(const Capsule& a, const Capsule& b);

}  // namespace hilbrush
