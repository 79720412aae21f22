#pragma once
#include <cstdint>
#include <vector>

#include "sampling/blue/touching_balls.h"

namespace hilbrush {

/// Stretches of consecutive dots, sorted into colours: stretches of one colour do not touch each other, so that
/// different threads may move their dots at a time, and every dot still sees where its neighbours are now.
struct Colouring {
  static constexpr std::size_t kStretch = 128;
  std::vector<std::vector<std::uint32_t>> stretches;  ///< by colour; stretch s holds dots s * kStretch on
};

/// Greedy, in order of the stretches. Cost O(neighbours).
Colouring colour_stretches(const IndexLists& neighbours);

}  // namespace hilbrush
