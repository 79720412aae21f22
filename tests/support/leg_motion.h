#pragma once
#include <algorithm>

#include "planner/cell_model/time_model.h"

/// The ways in which a cell may run one leg of a program, for tests that look at all of them.
namespace hilbrush::testing_support {

struct LegLaw {
  bool is_robot_coordinated = false;
  bool is_table_coordinated = false;
  double robot_late_s = 0, table_late_s = 0;

  Interpolation robot() const {
    return is_robot_coordinated ? Interpolation::kCoordinated : Interpolation::kIndependent;
  }
  Interpolation table() const {
    return is_table_coordinated ? Interpolation::kCoordinated : Interpolation::kIndependent;
  }
};

inline double leg_end_s(const CellDescription& cell, const LegLaw& law, const Joints& from,
                        const Joints& to) {
  return std::max(chain_move_s(cell, kRobotChain, law.robot(), from, to) + law.robot_late_s,
                  chain_move_s(cell, kTableChain, law.table(), from, to) + law.table_late_s);
}

inline Joints joints_on_leg(const CellDescription& cell, const LegLaw& law, const Joints& from,
                            const Joints& to, double time_s) {
  Joints joints = to;
  put_chain(cell, kRobotChain, law.robot(), from, to, time_s - law.robot_late_s, joints);
  put_chain(cell, kTableChain, law.table(), from, to, time_s - law.table_late_s, joints);
  return joints;
}

}  // namespace hilbrush::testing_support
