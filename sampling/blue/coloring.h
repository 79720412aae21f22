#pragma once
#include <cstdint>
#include <vector>

#include "sampling/blue/touching_balls.h"

namespace hilbrush {

/// Stretches of consecutive dots, sorted into colors: stretches of one color do not touch each other, so that
/// threads may move the dots of different stretches at the same time, and every dot still sees where its
/// neighbors are now.
struct Coloring {
  static constexpr std::size_t kStretch = 128;
  std::vector<std::vector<std::uint32_t>> stretches;  ///< by color; stretch s holds dots s * kStretch on
};

/// Greedy, in order of the stretches. Cost O(neighbors).
Coloring color_stretches(const IndexLists& neighbors);

}  // namespace hilbrush
