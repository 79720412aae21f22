#include "sampling/fine/cube_grid.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <utility>

namespace hilbrush {

CubeGrid::CubeGrid(std::span<const Eigen::Vector3f> places, float side_m) : per_side_(1 / side_m) {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> keys(places.size());
  tbb::parallel_for(std::size_t{0}, places.size(), [&](std::size_t i) {
    keys[i] = {key_of(coordinates_of(places[i])), static_cast<std::uint32_t>(i)};
  });
  tbb::parallel_sort(keys);
  order_.reserve(keys.size());
  for (const auto& [key, place] : keys) {
    const auto at = static_cast<std::uint32_t>(order_.size());
    if (cubes_.empty() || cubes_.back().key != key) cubes_.push_back({key, at, at});
    cubes_.back().end = at + 1;
    order_.push_back(place);
  }
  std::size_t size = 1;
  while (size < 2 * cubes_.size() + 1) size *= 2;
  table_.assign(size, kNoCube);
  for (std::uint32_t i = 0; i < cubes_.size(); ++i) {
    std::size_t slot = slot_of(cubes_[i].key);
    while (table_[slot] != kNoCube) slot = (slot + 1) & (size - 1);
    table_[slot] = i;
  }
}

}  // namespace hilbrush
