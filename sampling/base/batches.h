#pragma once
#include <algorithm>
#include <cstddef>

#include "sampling/base/progress.h"

namespace hilbrush {

/// Calls `work(begin, end)` for 0 to count - 1 in batches of `batch_size`, one after the other, and reports
/// the progress after each. For work that is parallel within a batch: the memory it takes at once is bounded,
/// and the progress comes from the caller's thread.
template <class Work>
void for_batches(std::size_t count, std::size_t batch_size, const Progress& progress, Work&& work) {
  for (std::size_t begin = 0; begin < count; begin += batch_size) {
    const std::size_t end = std::min(count, begin + batch_size);
    work(begin, end);
    progress.step(end, count);
  }
}

}  // namespace hilbrush
