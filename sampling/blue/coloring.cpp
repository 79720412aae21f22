#include "sampling/blue/coloring.h"

#include <algorithm>

namespace hilbrush {

Coloring color_stretches(const IndexLists& neighbors) {
  constexpr std::uint32_t kNone = ~std::uint32_t{0};
  const std::size_t count = neighbors.count();
  Coloring coloring;
  std::vector<std::uint32_t> color_of((count + Coloring::kStretch - 1) / Coloring::kStretch, kNone);
  std::vector<std::uint32_t> taken_by;  // per color: the last stretch that could not have it
  for (std::uint32_t stretch = 0; stretch < color_of.size(); ++stretch) {
    const std::size_t begin = stretch * Coloring::kStretch, end = std::min(begin + Coloring::kStretch, count);
    for (std::size_t i = begin; i < end; ++i)
      for (const std::uint32_t j : neighbors[i]) {
        const std::uint32_t color = color_of[j / Coloring::kStretch];
        if (color != kNone) taken_by[color] = stretch;
      }
    const auto free =
        std::find_if(taken_by.begin(), taken_by.end(), [&](std::uint32_t by) { return by != stretch; });
    const auto color = static_cast<std::uint32_t>(free - taken_by.begin());
    if (free == taken_by.end()) {
      taken_by.push_back(kNone);
      coloring.stretches.emplace_back();
    }
    color_of[stretch] = color;
    coloring.stretches[color].push_back(stretch);
  }
  return coloring;
}

}  // namespace hilbrush
