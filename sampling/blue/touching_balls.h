#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

/// Which balls overlap, of sizes that may differ by orders of magnitude: dots lie dense where the picture is
/// dark.
namespace hilbrush {

struct SizedBall {
  Eigen::Vector3d center_O;
  double radius_m = 0;  ///< more than 0
};

/// A list of indices for each index, in one piece of memory.
struct IndexLists {
  std::vector<std::size_t> begins;  ///< one more than there are lists
  std::vector<std::uint32_t> indices;

  std::size_t count() const { return begins.size() - 1; }
  std::span<const std::uint32_t> operator[](std::size_t i) const {
    return {indices.data() + begins[i], begins[i + 1] - begins[i]};
  }
};

/// For each ball the others that overlap it and that `accept` (symmetric, thread-safe) accepts. Balls are
/// kept in grids of one octave of radius each; a pair is found from its smaller ball. Same lists for any
/// number of threads. Cost: O(balls * octaves + pairs).
IndexLists find_touching_balls(std::span<const SizedBall> balls,
                               const std::function<bool(std::uint32_t, std::uint32_t)>& accept);

}  // namespace hilbrush
