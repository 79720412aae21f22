#include "planner/cell_model/exposure_program.h"

#include <algorithm>

namespace hilbrush {

std::string provenance_mismatch(const Provenance& found, const Provenance& wanted) {
  if (found.cell_sha256 != wanted.cell_sha256) return "another cell";
  if (found.model_sha256 != wanted.model_sha256) return "another model";
  if (found.settings_sha256 != wanted.settings_sha256) return "other settings";
  return "";
}

std::span<const Via> ExposureProgram::vias_before(std::size_t i) const {
  const auto [first, last] =
      std::equal_range(vias.begin(), vias.end(), Via{static_cast<std::uint32_t>(i), {}},
                       [](const Via& a, const Via& b) { return a.before_exposure < b.before_exposure; });
  return {first, last};
}

}  // namespace hilbrush
