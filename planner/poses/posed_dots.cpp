#include "planner/poses/posed_dots.h"

namespace hilbrush {

Target target_of(const Dot& dot) {
  Target target{dot.position_O, dot.normal_O.cast<double>().normalized(), dot.smooth_normal_O.cast<double>()};
  const double length = target.smooth_normal_O.norm();
  target.smooth_normal_O =
      length > .5 ? Eigen::Vector3d(target.smooth_normal_O / length) : target.face_normal_O;
  return target;
}

}  // namespace hilbrush
