#pragma once
#include <vector>

#include "sampling/curve/strata.h"
#include "sampling/dots.h"

/// Dots `first` to `last` - 1 of the curve, whatever comes before and after them.
namespace hilbrush {

struct DotBlock {
  std::vector<Dot> dots;
  std::vector<std::size_t> patches_at_depth;  ///< visited; those that begin before the block are not counted
};

DotBlock make_block(const DotPlan& plan, std::uint64_t first, std::uint64_t last);

}  // namespace hilbrush
