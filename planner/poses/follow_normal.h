#pragma once
#include <span>

#include "planner/poses/posed_dots.h"
#include "sampling/base/progress.h"

/// The baseline that pose search is measured against: the beam meets every dot along its normal, one after
/// another in the order given. The table turns for each of them; of the poses that bring the beam along the
/// smooth normal, the axes move to the one that they reach soonest. Where no beam along the normal is
/// possible, the nearest possible one.
namespace hilbrush {

/// Cost: a few dozen arm solutions a dot. One thread: each pose depends on the one before.
PosedDots follow_normal(const Reach& reach, const DotSequence& dots,
                        std::span<const std::uint32_t> dot_indices, const Progress& progress = {});

}  // namespace hilbrush
