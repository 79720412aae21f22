#include "sampling/blue/coloring.h"

#include <algorithm>

namespace hilbrush {

Colouring colour_stretches(const IndexLists& neighbours) {
  constexpr std::uint32_t kNone = ~std::uint32_t{0};
  const std::size_t count = neighbours.count();
  Colouring colouring;
  std::vector<std::uint32_t> colour_of((count + Colouring::kStretch - 1) / Colouring::kStretch, kNone);
  std::vector<std::uint32_t> taken_by;  // per colour: the last stretch that could not have it
  for (std::uint32_t stretch = 0; stretch < colour_of.size(); ++stretch) {
    const std::size_t begin = stretch * Colouring::kStretch, end = std::min(begin + Colouring::kStretch, count);
    for (std::size_t i = begin; i < end; ++i)
      for (const std::uint32_t j : neighbours[i]) {
        const std::uint32_t colour = colour_of[j / Colouring::kStretch];
        if (colour != kNone) taken_by[colour] = stretch;
      }
    const auto free = std::find_if(taken_by.begin(), taken_by.end(), [&](std::uint32_t by) { return by != stretch; });
    const auto colour = static_cast<std::uint32_t>(free - taken_by.begin());
    if (free == taken_by.end()) {
      taken_by.push_back(kNone);
      colouring.stretches.emplace_back();
    }
    colour_of[stretch] = colour;
    colouring.stretches[colour].push_back(stretch);
  }
  return colouring;
}

}  // namespace hilbrush
