#include "planner/cell_model/exposure_program.h"

#include <algorithm>

namespace hilbrush {

std::span<const Via> ExposureProgram::vias_before(std::size_t i) const {
  const auto [first, last] =
      std::equal_range(vias.begin(), vias.end(), Via{static_cast<std::uint32_t>(i), {}},
                       [](const Via& a, const Via& b) { return a.before_exposure < b.before_exposure; });
  return {first, last};
}

}  // namespace hilbrush
