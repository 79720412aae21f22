#include "sampling/gaps/dot_grid.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace hilbrush {

DotGrid::DotGrid(const std::vector<Dot>& dots, double size_m) : dots_(dots), size_(size_m), slots_(1024) {
  for (std::uint32_t i = 0; i < dots.size(); ++i) add(i);
}

DotGrid::Cell DotGrid::cell_of(const Eigen::Vector3d& place_O) const {
  return (place_O / size_).array().floor().cast<std::int64_t>();
}

std::uint64_t DotGrid::key_of(const Cell& cell) {
  const auto bits = [](std::int64_t c) { return static_cast<std::uint64_t>(c) & 0x1fffffu; };
  return bits(cell.x()) << 42 | bits(cell.y()) << 21 | bits(cell.z());
}

std::size_t DotGrid::slot_of(std::uint64_t key) const {
  std::size_t slot = (key * 0x9e3779b97f4a7c15u >> 20) & (slots_.size() - 1);
  while (slots_[slot].head != kNone && slots_[slot].key != key) slot = (slot + 1) & (slots_.size() - 1);
  return slot;
}

void DotGrid::grow() {
  std::vector<Slot> old(2 * slots_.size());
  std::swap(old, slots_);
  for (const Slot& slot : old)
    if (slot.head != kNone) slots_[slot_of(slot.key)] = slot;
}

void DotGrid::add(std::uint32_t dot) {
  if (2 * used_ >= slots_.size()) grow();
  if (next_.size() <= dot) next_.resize(dot + 1, kNone);
  const std::uint64_t key = key_of(cell_of(dots_[dot].position_O));
  Slot& slot = slots_[slot_of(key)];
  used_ += slot.head == kNone;
  next_[dot] = std::exchange(slot.head, dot);
  slot.key = key;
}

template <class Visit>
void DotGrid::visit_cell(const Cell& cell, const Eigen::Vector3d& place_O, const Eigen::Vector3f& normal_O,
                         Visit visit) const {
  for (std::uint32_t i = slots_[slot_of(key_of(cell))].head; i != kNone; i = next_[i])
    if (dots_[i].normal_O.dot(normal_O) > static_cast<float>(kSameSide))
      visit(i, (dots_[i].position_O - place_O).norm());
}

DotGrid::Nearest DotGrid::nearest(const Eigen::Vector3d& place_O, const Eigen::Vector3f& normal_O,
                                  double reach_m) const {
  const Cell middle = cell_of(place_O);
  Nearest best;
  const auto take = [&best](std::uint32_t dot, double distance) {
    // Of equally near dots the one with the lowest index, so that the order within a cell does not matter.
    if (distance < best.distance_m || (distance == best.distance_m && dot < best.dot)) best = {dot, distance};
  };
  // Shell by shell of cells around the middle one: shell s is at least s - 1 cells away.
  for (std::int64_t s = 0; static_cast<double>(s - 1) * size_ < std::min(best.distance_m, reach_m); ++s)
    for (std::int64_t x = -s; x <= s; ++x)
      for (std::int64_t y = -s; y <= s; ++y) {
        const bool is_side = std::abs(x) == s || std::abs(y) == s;
        for (std::int64_t z = -s; z <= s; z += is_side || s == 0 ? 1 : 2 * s)
          visit_cell(middle + Cell(x, y, z), place_O, normal_O, take);
      }
  return best.distance_m <= reach_m ? best : Nearest{};
}

std::vector<std::uint32_t> DotGrid::within(const Eigen::Vector3d& place_O, const Eigen::Vector3f& normal_O,
                                           double reach_m) const {
  std::vector<std::uint32_t> found;
  const Cell low = cell_of(place_O - Eigen::Vector3d::Constant(reach_m));
  const Cell high = cell_of(place_O + Eigen::Vector3d::Constant(reach_m));
  for (std::int64_t x = low.x(); x <= high.x(); ++x)
    for (std::int64_t y = low.y(); y <= high.y(); ++y)
      for (std::int64_t z = low.z(); z <= high.z(); ++z)
        visit_cell({x, y, z}, place_O, normal_O, [&](std::uint32_t dot, double distance) {
          if (distance <= reach_m) found.push_back(dot);
        });
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace hilbrush
