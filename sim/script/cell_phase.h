#pragma once
#include <array>

namespace hilbrush {

/// Where one dot's work stands, as the mechanics and the light have it.
enum class CellPhase { kSettled, kMoving, kSettling, kPulse };
inline constexpr std::array<const char*, 4> kCellPhaseNames{"settled", "moving", "settling", "pulse"};

}  // namespace hilbrush
