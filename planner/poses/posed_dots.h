#pragma once
#include <cstdint>
#include <vector>

#include "planner/reach/reach.h"
#include "sampling/base/progress.h"
#include "sampling/dots/dots.h"

/// The result of pose search: which dots are exposed, in which order, with which joints. The program builder
/// adds how the axes get from one to the next.
namespace hilbrush {

struct PosedDot {
  std::uint32_t dot_index = 0;
  Joints joints{};
};

struct PosedDots {
  std::vector<PosedDot> sequence;
  std::vector<SkippedDot> skipped;
};

Target target_of(const Dot& dot);

}  // namespace hilbrush
