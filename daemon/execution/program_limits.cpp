#include "daemon/execution/program_limits.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

namespace hilbrush {
namespace {

constexpr double kJointTolerance = 1e-9;  ///< rad or m: what arithmetic may put outside a limit

std::string millimeters_or_degrees(std::size_t axis, double value) {
  const bool is_prismatic = axis == kJ3;
  const double figure = is_prismatic ? value * 1e3 : value * 180 / std::numbers::pi;
  std::string text = std::to_string(std::round(figure * 1e3) / 1e3);
  text.erase(text.find_last_not_of('0') + 1);
  if (!text.empty() && text.back() == '.') text.pop_back();
  return text + (is_prismatic ? " mm" : " degrees");
}

/// Written so that NaN fails it.
bool is_within(const AxisDescription& limits, double value) {
  return value >= limits.min - kJointTolerance && value <= limits.max + kJointTolerance;
}

}  // namespace

bool is_within_limits(const CellDescription& cell, const Joints& target) {
  for (std::size_t axis = 0; axis < kAxisCount; ++axis)
    if (!is_within(cell.axes[axis], target[axis])) return false;
  return true;
}

void check_pose(const CellDescription& cell, const Joints& target, std::size_t exposure) {
  for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
    const auto& limits = cell.axes[axis];
    if (is_within(limits, target[axis])) continue;
    throw ProgramRefused("the program asks axis " + std::string(kAxisNames[axis]) + " for " +
                         millimeters_or_degrees(axis, target[axis]) + " at exposure " +
                         std::to_string(exposure) + ", outside its limits " +
                         millimeters_or_degrees(axis, limits.min) + " to " +
                         millimeters_or_degrees(axis, limits.max));
  }
}

void check_pulse(const Laser::Limits& limits, const Exposure& exposure, std::size_t i) {
  constexpr double kRelative = 1e-6;  // program files keep floats
  const double power = exposure.power_w;
  const double pulse = exposure.pulse_s;
  const auto within = [](double value, double low, double high) {
    return value >= low * (1 - kRelative) && value <= high * (1 + kRelative);
  };
  if (!within(power, limits.power_min_w, limits.power_max_w))
    throw ProgramRefused("exposure " + std::to_string(i) + " asks for " + std::to_string(power) +
                         " W, outside the laser's limits");
  if (!within(pulse, limits.pulse_min_s, limits.pulse_max_s))
    throw ProgramRefused("exposure " + std::to_string(i) + " asks for a pulse of " + std::to_string(pulse) +
                         " s, outside the laser's limits");
}

}  // namespace hilbrush
