#pragma once
#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

/// Places sorted into cubes, to find those around a place.
///
/// There are three such grids because their demands differ: this one holds a fixed set in single precision
/// and keeps each cube's places side by side (what `fine` reads in its inner loop); DotGrid (sampling/gaps)
/// takes in new dots between look-ups and searches to any distance; touching balls (sampling/blue) differ in
/// size by orders of magnitude, so each octave of radius has its own side. They also visit places in
/// different orders, and sums of floating-point numbers depend on that order.
namespace hilbrush {

class CubeGrid {
 public:
  /// Cost O(n log n); the same grid for any number of threads. Two million sides (2^21) apart cubes share a
  /// key, so their places are visited together: callers compare distances.
  CubeGrid(std::span<const Eigen::Vector3f> places, float side_m);

  std::size_t cube_count() const { return cubes_.size(); }
  /// Indices of the places in a cube, in rising order.
  std::span<const std::uint32_t> in_cube(std::size_t cube) const {
    return {order_.data() + cubes_[cube].begin, cubes_[cube].end - cubes_[cube].begin};
  }

  /// Visits the index of each place in the 27 cubes about that of `center`: a superset of those within one
  /// side of it, always in the same order.
  template <class Visit>
  void visit_around(const Eigen::Vector3f& center, Visit visit) const {
    const Coordinates middle = coordinates_of(center);
    for (int k = 0; k < 27; ++k) {
      const std::uint32_t cube =
          find(key_of({middle[0] + k % 3 - 1, middle[1] + k / 3 % 3 - 1, middle[2] + k / 9 - 1}));
      if (cube == kNoCube) continue;
      for (std::uint32_t i = cubes_[cube].begin; i < cubes_[cube].end; ++i) visit(order_[i]);
    }
  }

 private:
  using Coordinates = std::array<std::int64_t, 3>;
  struct Cube {
    std::uint64_t key;
    std::uint32_t begin, end;
  };
  static constexpr std::uint32_t kNoCube = ~std::uint32_t{0};

  Coordinates coordinates_of(const Eigen::Vector3f& place) const {
    const Eigen::Vector3f c = place * per_side_;
    return {static_cast<std::int64_t>(std::floor(c.x())), static_cast<std::int64_t>(std::floor(c.y())),
            static_cast<std::int64_t>(std::floor(c.z()))};
  }
  static std::uint64_t key_of(const Coordinates& c) {
    constexpr int kBits = 21;
    std::uint64_t key = 0;
    for (int k = 0; k < 3; ++k)
      key = key << kBits |
            (static_cast<std::uint64_t>(c[static_cast<std::size_t>(2 - k)]) & ((1u << kBits) - 1));
    return key;
  }
  std::size_t slot_of(std::uint64_t key) const {
    return static_cast<std::size_t>((key ^ key >> 29) * 0x9e3779b97f4a7c15u >> 20) & (table_.size() - 1);
  }
  std::uint32_t find(std::uint64_t key) const {
    for (std::size_t slot = slot_of(key); table_[slot] != kNoCube; slot = (slot + 1) & (table_.size() - 1))
      if (cubes_[table_[slot]].key == key) return table_[slot];
    return kNoCube;
  }

  float per_side_;
  std::vector<std::uint32_t> order_;
  std::vector<Cube> cubes_;
  std::vector<std::uint32_t> table_;  ///< key to cube: open addressing
};

}  // namespace hilbrush
