#pragma once
#include <numbers>

namespace hilbrush {

inline constexpr double kDegree = std::numbers::pi / 180;  ///< in radians
inline constexpr double kTurn = 2 * std::numbers::pi;      ///< in radians

}  // namespace hilbrush
