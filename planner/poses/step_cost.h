#pragma once
#include <algorithm>
#include <array>
#include <cmath>

#include "planner/cell_description.h"

/// The time model for what search asks millions of times: move and settle between two exposures from one pose of the
/// table, in single precision. Agrees with move_s() + settle_s() - settle_min_s to a rounding.
namespace hilbrush {

/// J1..J4.
using ArmJoints = std::array<float, 4>;

class StepCost {
 public:
  explicit StepCost(const CellDescription& cell)
      : tick_s_(static_cast<float>(cell.timing.tick_s)),
        settle_span_s_(static_cast<float>(cell.timing.settle_max_s - cell.timing.settle_min_s)) {
    for (std::size_t i = 0; i < 4; ++i) {
      const AxisDescription& axis = cell.axes[i];
      inverse_acceleration_[i] = static_cast<float>(1 / axis.acceleration_max);
      ramps_[i] = static_cast<float>(axis.speed_max * axis.speed_max / axis.acceleration_max);
      inverse_speed_[i] = static_cast<float>(1 / axis.speed_max);
      ramp_s_[i] = static_cast<float>(axis.speed_max / axis.acceleration_max);
      inverse_saturation_[i] = axis.settle_saturation > 0 ? static_cast<float>(1 / axis.settle_saturation) : 0;
    }
  }

  /// Seconds above the shortest settling.
  float operator()(const ArmJoints& from, const ArmJoints& to) const {
    float ramping = 0, cruising_s = 0,
          share = 0;  // the slowest of those that do not reach full speed, and of those that do
    for (std::size_t i = 0; i < 4; ++i) {
      const float distance = std::abs(from[i] - to[i]);
      share = std::max(share, distance * inverse_saturation_[i]);
      if (distance <= ramps_[i])
        ramping = std::max(ramping, distance * inverse_acceleration_[i]);
      else
        cruising_s = std::max(cruising_s, distance * inverse_speed_[i] + ramp_s_[i]);
    }
    float move_s = std::max(cruising_s, 2 * std::sqrt(ramping));
    if (tick_s_ > 0) move_s = std::ceil(move_s / tick_s_ - 1e-4F) * tick_s_;
    return move_s + settle_span_s_ * std::min(1.F, share);
  }

 private:
  float tick_s_, settle_span_s_;
  std::array<float, 4> inverse_acceleration_{}, ramps_{}, inverse_speed_{}, ramp_s_{}, inverse_saturation_{};
};

}  // namespace hilbrush
