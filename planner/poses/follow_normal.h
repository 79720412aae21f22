#pragma once
#include <span>

#include "planner/poses/posed_dots.h"
#include "sampling/base/progress.h"

/// The baseline that pose search is measured against: every dot is met head-on, one after another in the order given.
/// The table turns for each of them; of the poses that bring the beam along the smooth normal, the one is taken that
/// the axes reach soonest. Where no beam along the normal will do, the nearest to it that does.
namespace hilbrush {

/// Cost: a few dozen arm solutions a dot. One thread: each pose depends on the one before.
PosedDots follow_normal(const Reach& reach, const DotSequence& dots, std::span<const std::uint32_t> dot_indices,
                        const Progress& progress = {});

}  // namespace hilbrush
