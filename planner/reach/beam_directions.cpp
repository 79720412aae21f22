#include "planner/reach/beam_directions.h"

#include <cmath>
#include <numbers>

namespace hilbrush {

BeamDirections::BeamDirections(double spacing) {
  const auto count = static_cast<std::size_t>(4 * std::numbers::pi / (.866 * spacing * spacing));
  directions_O_.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double z = 1 - (2 * static_cast<double>(i) + 1) / static_cast<double>(count);
    const double turn = static_cast<double>(i) * std::numbers::pi * (3 - std::sqrt(5.));
    const double r = std::sqrt(1 - z * z);
    directions_O_.emplace_back(r * std::cos(turn), r * std::sin(turn), z);
  }
}

std::vector<std::uint32_t> BeamDirections::that_hit(const Reach& reach, const Target& target,
                                                    double cos_least) const {
  std::vector<std::uint32_t> hitting;
  for (std::uint32_t d = 0; d < directions_O_.size(); ++d)
    if (-directions_O_[d].dot(target.smooth_normal_O) >= cos_least && reach.can_hit(target, directions_O_[d]))
      hitting.push_back(d);
  return hitting;
}

}  // namespace hilbrush
