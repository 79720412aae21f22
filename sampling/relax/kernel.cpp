#include "sampling/relax/kernel.h"

#include <cmath>

namespace hilbrush {

Eigen::Vector2f TangentSlope::newton_step(float least) const {
  const float mean = .5f * (xx_ + yy_), half = .5f * (xx_ - yy_);
  const float spread = std::hypot(half, xy_), turn = .5f * std::atan2(xy_, half);
  const Eigen::Vector2f axis(std::cos(turn), std::sin(turn)), other(-axis.y(), axis.x());
  const auto along = [&](const Eigen::Vector2f& direction, float curvature) {
    return Eigen::Vector2f(-gradient_.dot(direction) / std::max(std::abs(curvature), least) * direction);
  };
  return along(axis, mean + spread) + along(other, mean - spread);
}

}  // namespace hilbrush
