#pragma once
#include <tbb/parallel_for.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

/// Finds the place that is farthest from all points, by branch and bound: in a triangle whose middle is d
/// from the nearest point and r from its own farthest corner, no place is farther than d + r from all points.
namespace hilbrush {

/// A flat triangle in space that is searched. `face` is passed to the distance function.
struct SearchTriangle {
  std::array<Eigen::Vector3d, 3> corners;
  std::uint32_t face = 0;

  Eigen::Vector3d middle() const { return (corners[0] + corners[1] + corners[2]) / 3; }
  double reach(const Eigen::Vector3d& from) const {
    double farthest = 0;
    for (const auto& corner : corners) farthest = std::max(farthest, (corner - from).squaredNorm());
    return std::sqrt(farthest);
  }
  /// Divided at the middle of its longest side.
  std::array<SearchTriangle, 2> halves() const {
    std::size_t longest = 0;
    double length = -1;
    for (std::size_t k = 0; k < 3; ++k)
      if (const double side = (corners[(k + 1) % 3] - corners[k]).squaredNorm(); side > length) {
        length = side;
        longest = k;
      }
    const Eigen::Vector3d middle = (corners[longest] + corners[(longest + 1) % 3]) / 2;
    SearchTriangle a = *this;
    SearchTriangle b = *this;
    a.corners[(longest + 1) % 3] = middle;
    b.corners[longest] = middle;
    return {a, b};
  }
};

struct SearchLimits {
  double precision = 1e-3;  ///< relative error of the result
  double smallest_m = 0;    ///< triangles whose corners are no farther from their middle are not divided
};

/// Largest value of `distance(place, face)` over all triangles; `distance` must not rise faster than the
/// place moves. Depth first, a fixed number of triangles at a time in parallel: little memory, and the same
/// result for any number of threads.
template <class Distance>
double largest_distance(std::vector<SearchTriangle> open, const Distance& distance,
                        const SearchLimits& limits = {}) {
  constexpr std::size_t kBatch = 1 << 14;  // triangles
  double best = 0;
  std::vector<double> at_middle(kBatch), bound(kBatch);
  std::vector<SearchTriangle> batch;
  while (!open.empty()) {
    const std::size_t count = std::min(kBatch, open.size());
    batch.assign(open.end() - static_cast<std::ptrdiff_t>(count), open.end());
    open.resize(open.size() - count);
    tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
      const Eigen::Vector3d middle = batch[i].middle();
      const double reach = batch[i].reach(middle);
      at_middle[i] = distance(middle, batch[i].face);
      bound[i] = reach > limits.smallest_m ? at_middle[i] + reach : 0;
    });
    for (std::size_t i = 0; i < count; ++i) best = std::max(best, at_middle[i]);
    for (std::size_t i = 0; i < count; ++i) {
      if (!(bound[i] > best * (1 + limits.precision))) continue;
      for (const SearchTriangle& half : batch[i].halves()) open.push_back(half);
    }
  }
  return best;
}

}  // namespace hilbrush
