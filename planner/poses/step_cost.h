#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "planner/reach/kinematics.h"

/// The time model for the innermost loops of the search: move and settle between two exposures from one pose
/// of the table, in single precision. Agrees with move_s() + settle_s() - settle_min_s to a rounding.
namespace hilbrush {

/// J1..J4.
using ArmJoints = std::array<float, 4>;

inline ArmJoints arm_of(const Joints& joints) {
  return {static_cast<float>(joints[kJ1]), static_cast<float>(joints[kJ2]), static_cast<float>(joints[kJ3]),
          static_cast<float>(joints[kJ4])};
}

class StepCost {
 public:
  explicit StepCost(const CellDescription& cell)
      : is_coordinated_(cell.motion.robot == Interpolation::kCoordinated),
        tick_s_(static_cast<float>(cell.timing.tick_s)),
        settle_span_s_(static_cast<float>(cell.timing.settle_max_s - cell.timing.settle_min_s)) {
    for (std::size_t i = 0; i < 4; ++i) {
      const AxisDescription& axis = cell.axes[i];
      const double factor = axis.time_factor;
      factor_[i] = static_cast<float>(factor);
      inverse_acceleration_[i] = static_cast<float>(factor * factor / axis.acceleration_max);
      ramps_[i] = static_cast<float>(axis.speed_max * axis.speed_max / axis.acceleration_max);
      inverse_speed_[i] = static_cast<float>(factor / axis.speed_max);
      ramp_s_[i] = static_cast<float>(factor * axis.speed_max / axis.acceleration_max);
      inverse_saturation_[i] =
          axis.settle_saturation > 0 ? static_cast<float>(1 / axis.settle_saturation) : 0;
    }
  }

  /// Seconds above the shortest settling.
  float operator()(const ArmJoints& from, const ArmJoints& to) const { return cost_s(difference(from, to)); }

  /// The same if the tool turns a little during the move, by the angle that is best for the step: J1, J2 and
  /// J4 then share a move that would otherwise be J1's and J2's alone. `per_yaw`: how the joints follow the
  /// yaw at either end. Symmetric. `share` of the time saved is subtracted. From `enough_s` on the result may
  /// be a lower bound that is not below `enough_s`: most callers only compare steps, and a bound is enough
  /// for that.
  float with_turn(const ArmJoints& from, const ArmJoints& to, const ArmJoints& from_per_yaw,
                  const ArmJoints& to_per_yaw, float share = 1,
                  float enough_s = std::numeric_limits<float>::infinity()) const {
    const ArmJoints step = difference(from, to);
    const float plain_s = cost_s(step);
    // No step is shorter than one tick, and no turn helps J3.
    const float least_s = std::max(tick_s_, axis_s(2, std::abs(step[2])));
    if (plain_s <= std::max(1.5F * tick_s_, least_s)) return plain_s;
    const float bound_s = plain_s - share * (plain_s - least_s);
    if (bound_s >= enough_s) return bound_s;
    std::array<float, 3> at, slope;
    ArmJoints rate{};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t i = kTurning[k];
      rate[i] = .5F * (from_per_yaw[i] + to_per_yaw[i]);
      at[k] = step[i] * inverse_acceleration_[i];
      slope[k] = rate[i] * inverse_acceleration_[i];
    }
    const float turn = least_maximum(at, slope);
    ArmJoints turned = step;
    for (const std::size_t i : kTurning) turned[i] += turn * rate[i];
    return plain_s - share * std::max(0.F, plain_s - cost_s(turned));
  }

 private:
  static constexpr std::array<std::size_t, 3> kTurning{0, 1, 3};

  static ArmJoints difference(const ArmJoints& from, const ArmJoints& to) {
    return {to[0] - from[0], to[1] - from[1], to[2] - from[2], to[3] - from[3]};
  }

  float axis_s(std::size_t i, float distance) const {
    return distance <= ramps_[i] ? 2 * std::sqrt(distance * inverse_acceleration_[i])
                                 : distance * inverse_speed_[i] + ramp_s_[i];
  }

  float cost_s(const ArmJoints& step) const {
    float share = 0;
    for (std::size_t i = 0; i < 4; ++i) share = std::max(share, std::abs(step[i]) * inverse_saturation_[i]);
    float move_s = is_coordinated_ ? coordinated_s(step) : independent_s(step);
    if (tick_s_ > 0) move_s = whole_ticks(move_s / tick_s_ - 1e-4F) * tick_s_;
    return move_s + settle_span_s_ * std::min(1.F, share);
  }

  float independent_s(const ArmJoints& step) const {
    float ramping = 0;     // of the slowest axis that does not reach full speed
    float cruising_s = 0;  // of the slowest axis that does
    for (std::size_t i = 0; i < 4; ++i) {
      const float distance = std::abs(step[i]);
      if (distance <= ramps_[i])
        ramping = std::max(ramping, distance * inverse_acceleration_[i]);
      else
        cruising_s = std::max(cruising_s, distance * inverse_speed_[i] + ramp_s_[i]);
    }
    return std::max(cruising_s, 2 * std::sqrt(ramping));
  }

  /// All joints by the law that the weakest allows: the move is 1 long.
  float coordinated_s(const ArmJoints& step) const {
    float per_speed_s = 0;          // 1 over the speed that all joints allow
    float per_acceleration_s2 = 0;  // 1 over the acceleration
    float factor = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const float distance = std::abs(step[i]);
      if (distance <= 0) continue;
      per_speed_s = std::max(per_speed_s, distance * inverse_speed_[i] / factor_[i]);
      per_acceleration_s2 =
          std::max(per_acceleration_s2, distance * inverse_acceleration_[i] / (factor_[i] * factor_[i]));
      factor = std::max(factor, factor_[i]);
    }
    if (per_speed_s <= 0) return 0;
    const bool is_triangle = per_speed_s * per_speed_s <= per_acceleration_s2;
    return factor * (is_triangle ? 2 * std::sqrt(per_acceleration_s2)
                                 : per_speed_s + per_acceleration_s2 / per_speed_s);
  }

  /// std::ceil of what is over -1 and far below the largest int, which without SSE 4.1 is a call.
  static float whole_ticks(float ticks) {
    const auto begun = static_cast<float>(static_cast<int>(ticks));
    return begun < ticks ? begun + 1 : begun;
  }

  /// Where the largest of |at + slope * x| is least: two of them are equal there.
  static float least_maximum(const std::array<float, 3>& at, const std::array<float, 3>& slope) {
    const auto largest = [&](float x) {
      return std::max(std::abs(at[0] + slope[0] * x),
                      std::max(std::abs(at[1] + slope[1] * x), std::abs(at[2] + slope[2] * x)));
    };
    float best = 0;
    float least = largest(0);
    const auto consider = [&](float difference, float slope_difference) {
      if (std::abs(slope_difference) < 1e-12F) return;
      const float x = -difference / slope_difference;
      const float value = largest(x);
      if (!(value < least)) return;
      least = value;
      best = x;
    };
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t j = (i + 1) % 3;
      consider(at[i] - at[j], slope[i] - slope[j]);
      consider(at[i] + at[j], slope[i] + slope[j]);
    }
    return best;
  }

  bool is_coordinated_;
  float tick_s_, settle_span_s_;
  std::array<float, 4> factor_{};
  std::array<float, 4> inverse_acceleration_{}, ramps_{}, inverse_speed_{}, ramp_s_{}, inverse_saturation_{};
};

}  // namespace hilbrush
