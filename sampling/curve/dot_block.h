#pragma once
#include <vector>

#include "sampling/curve/dot_triangle.h"
#include "sampling/curve/strata.h"
#include "sampling/dots/dots.h"

namespace hilbrush {

/// Dots that lie one after another on the curve, whatever comes before and after them.
struct DotBlock {
  std::vector<Dot> dots;
  std::vector<std::size_t> patches_at_depth;  ///< visited; those that begin before the block are not counted
};

/// Makes blocks of a plan's dots. A block depends on nothing but its dots' numbers; what the maker keeps from
/// block to block only saves time. For one thread.
class BlockMaker {
 public:
  explicit BlockMaker(const DotPlan& plan);

  /// Dots `first` to `last` - 1, into a block that may have been used before.
  void make(std::uint64_t first, std::uint64_t last, DotBlock& block);

 private:
  const DotPlan& plan_;
  Walks walks_;
  DotTriangles triangles_;
};

}  // namespace hilbrush
