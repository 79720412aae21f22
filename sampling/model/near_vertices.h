#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace hilbrush {

/// Finds vertices that are nearer to each other than a distance, by a grid of much larger cells. Cost O(n log
/// n).
class NearVertices {
 public:
  NearVertices(const std::vector<Eigen::Vector3d>& vertices, double distance)
      : vertices_(vertices),
        distance_(distance),
        low_(vertices.empty() ? Eigen::Vector3d::Zero() : vertices[0]) {
    for (const Eigen::Vector3d& p : vertices) low_ = low_.cwiseMin(p);
    for (std::uint32_t v = 0; v < vertices.size(); ++v) cells_.push_back({cell_of(vertices[v]), v});
    std::sort(cells_.begin(), cells_.end());
  }

  /// Calls `visit(v, w)` for pairs of near vertices, v < w: for all of a sparse cell, for a chain of them in
  /// a crowded one, whose vertices all count as near.
  template <class Visit>
  void for_each_pair(const Visit& visit) const {
    for (auto begin = cells_.begin(); begin != cells_.end();) {
      auto end = begin;
      while (end != cells_.end() && end->first == begin->first) ++end;
      const bool is_crowded = end - begin > kCrowd;
      for (auto entry = begin; entry != end; ++entry) {
        if (is_crowded && entry != begin) visit(begin->second, entry->second);
        for (auto other = entry + 1; !is_crowded && other != end; ++other)
          visit_if_near(*entry, *other, visit);
        visit_neighbors(*entry, visit);
      }
      begin = end;
    }
  }

 private:
  using Cell = std::array<std::int64_t, 3>;
  using Entry = std::pair<Cell, std::uint32_t>;
  static constexpr double kCellDistances = 64;  ///< few vertices are near a side of so large a cell
  static constexpr std::ptrdiff_t kCrowd = 64;  ///< vertices; pairs of more would take long

  Cell cell_of(const Eigen::Vector3d& p) const {
    Cell cell{};
    for (int axis = 0; axis < 3; ++axis)
      cell[static_cast<std::size_t>(axis)] =
          static_cast<std::int64_t>(std::floor((p[axis] - low_[axis]) / (kCellDistances * distance_)));
    return cell;
  }

  template <class Visit>
  void visit_if_near(const Entry& a, const Entry& b, const Visit& visit) const {
    if ((vertices_[a.second] - vertices_[b.second]).squaredNorm() > distance_ * distance_) return;
    visit(std::min(a.second, b.second), std::max(a.second, b.second));
  }

  /// The cells that the vertex is so near to that a near one may be in them. Only those of greater order: the
  /// others' vertices find this one.
  template <class Visit>
  void visit_neighbors(const Entry& entry, const Visit& visit) const {
    const Eigen::Vector3d reach = Eigen::Vector3d::Constant(distance_);
    const Cell low = cell_of(vertices_[entry.second] - reach);
    const Cell high = cell_of(vertices_[entry.second] + reach);
    for (std::int64_t x = low[0]; x <= high[0]; ++x)
      for (std::int64_t y = low[1]; y <= high[1]; ++y)
        for (std::int64_t z = low[2]; z <= high[2]; ++z) {
          const Cell cell{x, y, z};
          if (cell <= entry.first) continue;
          auto other = std::lower_bound(cells_.begin(), cells_.end(), Entry{cell, 0});
          for (std::ptrdiff_t i = 0; i < kCrowd && other != cells_.end() && other->first == cell;
               ++i, ++other)
            visit_if_near(entry, *other, visit);
        }
  }

  const std::vector<Eigen::Vector3d>& vertices_;
  double distance_;
  Eigen::Vector3d low_;
  std::vector<Entry> cells_;
};

}  // namespace hilbrush
