#include "planner/poses/posed_dots.h"

#include "planner/cell_model/time_model.h"

namespace hilbrush {

Target target_of(const Dot& dot) {
  Target target{dot.position_O, dot.normal_O.cast<double>().normalized(), dot.smooth_normal_O.cast<double>()};
  const double length = target.smooth_normal_O.norm();
  target.smooth_normal_O = length > .5 ? Eigen::Vector3d(target.smooth_normal_O / length) : target.face_normal_O;
  return target;
}

Joints home_joints(const CellDescription& cell) {
  Joints home;
  for (std::size_t i = 0; i < kAxisCount; ++i) home[i] = cell.axes[i].home;
  return home;
}

double step_s(const CellDescription& cell, const Joints& from, const Joints& to) {
  return move_s(cell, from, to) + settle_s(cell, from, to);
}

}  // namespace hilbrush
