#pragma once
#include <cstdint>
#include <vector>

#include "planner/reach/reach.h"
#include "sampling/base/progress.h"
#include "sampling/dots/dots.h"

/// What pose search hands on: which dots are exposed, in which order, with which joints. How the axes get from one to
/// the next is the program builder's.
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
Joints home_joints(const CellDescription& cell);

/// Move and settle of a direct move between two exposures.
double step_s(const CellDescription& cell, const Joints& from, const Joints& to);

}  // namespace hilbrush
