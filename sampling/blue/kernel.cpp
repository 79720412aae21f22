#include "sampling/blue/kernel.h"

#include <cmath>

namespace hilbrush {

Eigen::Vector2f TangentSlope::newton_step(float least) {
  add_waiting();
  const float x = gradient_x_.sum(), y = gradient_y_.sum(), xx = xx_.sum(), xy = xy_.sum(), yy = yy_.sum();
  // The Hessian is mean + spread along one axis and mean - spread along the other; so is what is made of it
  // here, with the same axes: along them + spread and - spread is (half, xy; xy, -half).
  const float mean = .5f * (xx + yy), half = .5f * (xx - yy), spread = std::sqrt(half * half + xy * xy);
  const auto step_along = [&](float curvature) { return 1 / std::max(std::abs(curvature), least); };
  const float one = step_along(mean + spread), other = step_along(mean - spread);
  const float both = .5f * (one + other), apart = spread > 0 ? .5f * (one - other) / spread : 0;
  return {-both * x - apart * (half * x + xy * y), -both * y - apart * (xy * x - half * y)};
}

}  // namespace hilbrush
