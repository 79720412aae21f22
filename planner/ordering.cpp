#include "planner/ordering.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace hilbrush {
namespace {

constexpr std::size_t kNeighbours = 8;
constexpr std::int64_t kWindow = 5000;   // places that one move may shift or reverse
constexpr std::size_t kBlock = 1 << 15;  // dots that are improved together
constexpr std::int32_t kNone = -1;       // beyond an end of the path
constexpr float kLeastGainS = 1e-6F;

/// Move and settle between two dots, the table at rest.
class StepCost {
 public:
  StepCost(const CellDescription& cell, std::span<const PathDot> path) : path_(path) {
    for (std::size_t i = 0; i < 4; ++i) {
      const AxisDescription& axis = cell.axes[i];
      acceleration_[i] = static_cast<float>(axis.acceleration_max);
      speed_[i] = static_cast<float>(axis.speed_max);
      inverse_saturation_[i] = axis.settle_saturation > 0 ? static_cast<float>(1 / axis.settle_saturation) : 0;
    }
    tick_s_ = static_cast<float>(cell.timing.tick_s);
    settle_span_s_ = static_cast<float>(cell.timing.settle_max_s - cell.timing.settle_min_s);
  }

  float operator()(std::int32_t a, std::int32_t b) const {
    if (a == kNone || b == kNone) return 0;
    const auto &from = path_[static_cast<std::size_t>(a)].arm, &to = path_[static_cast<std::size_t>(b)].arm;
    float ramping = 0, cruising_s = 0, share = 0;  // the slowest of those that reach full speed and those that don't
    for (std::size_t i = 0; i < 4; ++i) {
      const float distance = std::abs(from[i] - to[i]);
      share = std::max(share, distance * inverse_saturation_[i]);
      if (distance * acceleration_[i] <= speed_[i] * speed_[i])
        ramping = std::max(ramping, distance / acceleration_[i]);
      else
        cruising_s = std::max(cruising_s, distance / speed_[i] + speed_[i] / acceleration_[i]);
    }
    float move_s = std::max(cruising_s, 2 * std::sqrt(ramping));
    if (tick_s_ > 0) move_s = std::ceil(move_s / tick_s_ - 1e-4F) * tick_s_;
    return move_s + settle_span_s_ * std::min(1.F, share);
  }

 private:
  std::span<const PathDot> path_;
  std::array<float, 4> acceleration_{}, speed_{}, inverse_saturation_{};
  float tick_s_ = 0, settle_span_s_ = 0;
};

/// The nearest dots of each dot, by a hash-free grid: dots sorted by cell.
class Neighbours {
 public:
  explicit Neighbours(std::span<const PathDot> path) : path_(path) {
    const std::size_t n = path.size();
    Eigen::Array3f low = path[0].position_O.array(), high = low;
    std::vector<float> steps;
    for (std::size_t i = 0; i < n; ++i) {
      low = low.min(path[i].position_O.array());
      high = high.max(path[i].position_O.array());
      if (i > 0) steps.push_back((path[i].position_O - path[i - 1].position_O).norm());
    }
    std::nth_element(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2), steps.end());
    low_ = low;
    const float extent = (high - low).maxCoeff();
    size_ = std::max({2 * steps[steps.size() / 2], extent / 1000, 1e-7F});
    count_ = ((high - low) / size_).cast<std::int64_t>() + 1;
    order_.resize(n);
    std::iota(order_.begin(), order_.end(), 0);
    std::vector<std::int64_t> keys(n);
    for (std::size_t i = 0; i < n; ++i) keys[i] = key(cell_of(i));
    std::sort(order_.begin(), order_.end(), [&](std::int32_t a, std::int32_t b) {
      const auto ka = keys[static_cast<std::size_t>(a)], kb = keys[static_cast<std::size_t>(b)];
      return ka != kb ? ka < kb : a < b;
    });
    keys_.resize(n);
    for (std::size_t i = 0; i < n; ++i) keys_[i] = keys[static_cast<std::size_t>(order_[i])];
    find_all();
  }

  std::span<const std::int32_t> of(std::int32_t dot) const {
    const std::size_t i = static_cast<std::size_t>(dot);
    return {near_.data() + first_[i], first_[i + 1] - first_[i]};
  }

 private:
  using Cell = Eigen::Array<std::int64_t, 3, 1>;
  Cell cell_of(std::size_t i) const {
    return ((path_[i].position_O.array() - low_) / size_).cast<std::int64_t>().min(count_ - 1);
  }
  std::int64_t key(const Cell& cell) const { return (cell[2] * count_[1] + cell[1]) * count_[0] + cell[0]; }

  void find_all() {
    const std::size_t n = path_.size();
    first_.assign(1, 0);
    near_.reserve(n * kNeighbours);
    std::vector<std::pair<float, std::int32_t>> found;
    for (std::size_t i = 0; i < n; ++i) {
      found.clear();
      collect(i, found);
      const std::size_t kept = std::min(kNeighbours, found.size());
      std::partial_sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(kept), found.end());
      for (std::size_t k = 0; k < kept; ++k) near_.push_back(found[k].second);
      first_.push_back(near_.size());
    }
  }

  /// From the dot's grid cell and those around it.
  void collect(std::size_t i, std::vector<std::pair<float, std::int32_t>>& found) const {
    const Cell cell = cell_of(i);
    const std::int64_t x_low = std::max<std::int64_t>(0, cell[0] - 1), x_high = std::min(count_[0] - 1, cell[0] + 1);
    for (std::int64_t z = cell[2] - 1; z <= cell[2] + 1; ++z)
      for (std::int64_t y = cell[1] - 1; y <= cell[1] + 1; ++y) {
        if (z < 0 || y < 0 || z >= count_[2] || y >= count_[1]) continue;
        // Cells along x follow each other in the sorted keys.
        const auto begin = std::lower_bound(keys_.begin(), keys_.end(), key({x_low, y, z}));
        const auto end = std::upper_bound(begin, keys_.end(), key({x_high, y, z}));
        for (auto it = begin; it != end; ++it) {
          const std::int32_t other = order_[static_cast<std::size_t>(it - keys_.begin())];
          if (static_cast<std::size_t>(other) != i)
            found.emplace_back((path_[i].position_O - path_[static_cast<std::size_t>(other)].position_O).squaredNorm(),
                               other);
        }
      }
  }

  std::span<const PathDot> path_;
  Eigen::Array3f low_;
  float size_ = 1;
  Cell count_;
  std::vector<std::int32_t> order_;  ///< dots by cell
  std::vector<std::int64_t> keys_;   ///< of the cells of order_
  std::vector<std::size_t> first_;
  std::vector<std::int32_t> near_;
};

/// The path as an array of dots, and its local improvement.
class LocalSearch {
 public:
  LocalSearch(const CellDescription& cell, std::span<const PathDot> path)
      : cost_(cell, path),
        neighbours_(path),
        dot_at_(path.size()),
        place_of_(path.size()),
        is_queued_(path.size(), true) {
    std::iota(dot_at_.begin(), dot_at_.end(), 0);
    std::iota(place_of_.begin(), place_of_.end(), 0);
  }

  std::vector<std::int32_t> run() {
    constexpr std::size_t kLooksADot = 40;  // a bound; a few are usual
    std::vector<std::int32_t> queue = dot_at_, next;
    for (std::size_t looks = 0; !queue.empty() && looks < kLooksADot * dot_at_.size();) {
      next.clear();
      next_ = &next;
      for (const std::int32_t dot : queue) {
        is_queued_[static_cast<std::size_t>(dot)] = false;
        for (++looks; improve(dot); ++looks) {
        }
      }
      queue.swap(next);
    }
    return std::move(dot_at_);
  }

 private:
  std::int64_t place(std::int32_t dot) const { return place_of_[static_cast<std::size_t>(dot)]; }
  std::int32_t at(std::int64_t place) const {
    return place < 0 || place >= static_cast<std::int64_t>(dot_at_.size()) ? kNone
                                                                           : dot_at_[static_cast<std::size_t>(place)];
  }
  void queue_again(std::int32_t dot) {
    if (dot == kNone || is_queued_[static_cast<std::size_t>(dot)]) return;
    is_queued_[static_cast<std::size_t>(dot)] = true;
    next_->push_back(dot);
  }

  bool improve(std::int32_t dot) { return two_opt(dot) || move_segment(dot); }

  /// Replaces the edge from `a` to its successor (or predecessor) and one at a neighbour.
  bool two_opt(std::int32_t a) {
    for (const std::int64_t side : {1, -1}) {
      const std::int32_t b = at(place(a) + side);
      const float edge_s = cost_(a, b);
      for (const std::int32_t c : neighbours_.of(a)) {
        const float new_s = cost_(a, c);
        if (new_s >= edge_s) continue;
        const std::int32_t d = at(place(c) + side);
        if (edge_s + cost_(c, d) - new_s - cost_(b, d) <= kLeastGainS) continue;
        const std::int64_t first = side > 0 ? std::min(place(a), place(c)) + 1 : std::min(place(a), place(c));
        const std::int64_t last = side > 0 ? std::max(place(a), place(c)) : std::max(place(a), place(c)) - 1;
        if (last - first >= kWindow) continue;
        reverse(first, last);
        for (const std::int32_t end : {a, b, c, d}) queue_again(end);
        return true;
      }
    }
    return false;
  }

  /// Moves one to three dots that begin or end with `a` next to a neighbour of `a`.
  bool move_segment(std::int32_t a) {
    for (const std::int64_t side : {1, -1})
      for (std::int64_t length = 1; length <= 3; ++length) {
        if (length == 1 && side < 0) continue;
        const std::int32_t e = at(place(a) + side * (length - 1));  // the segment's other end
        if (e == kNone) break;
        const std::int32_t before = at(place(a) - side), after = at(place(e) + side);
        const float removed_s = cost_(before, a) + cost_(e, after) - cost_(before, after);
        if (removed_s <= kLeastGainS) continue;
        for (const std::int32_t c : neighbours_.of(a)) {
          const std::int64_t offset = (place(c) - place(a)) * side;
          if (offset >= 0 && offset < length) continue;
          if (std::abs(offset) >= kWindow) continue;
          const float joint_s = cost_(c, a);
          if (joint_s >= removed_s) continue;
          for (const std::int64_t beyond : {1, -1}) {
            const std::int32_t d = at(place(c) + beyond);
            if (d == a || d == e) continue;  // the edge that is taken away
            if (removed_s + cost_(c, d) - joint_s - cost_(e, d) <= kLeastGainS) continue;
            insert(a, e, c, beyond);
            for (const std::int32_t end : {a, e, before, after, c, d}) queue_again(end);
            return true;
          }
        }
      }
    return false;
  }

  void reverse(std::int64_t first, std::int64_t last) {
    std::reverse(dot_at_.begin() + first, dot_at_.begin() + last + 1);
    renumber(first, last);
  }
  void renumber(std::int64_t first, std::int64_t last) {
    for (std::int64_t p = first; p <= last; ++p)
      place_of_[static_cast<std::size_t>(dot_at_[static_cast<std::size_t>(p)])] = static_cast<std::int32_t>(p);
  }

  /// The segment from `a` to `e` goes between `c` and the dot `beyond` it, `a` next to `c`.
  void insert(std::int32_t a, std::int32_t e, std::int32_t c, std::int64_t beyond) {
    const std::int64_t first = std::min(place(a), place(e)), last = std::max(place(a), place(e)), to = place(c);
    const auto begin = dot_at_.begin();
    const bool is_a_first = place(a) <= place(e);
    // Reading along the path, a segment put behind c begins with a; one put before c ends with it.
    if (is_a_first != (beyond > 0)) std::reverse(begin + first, begin + last + 1);
    if (to > last) {
      const std::int64_t end = beyond > 0 ? to + 1 : to;  // the segment's end, exclusive
      std::rotate(begin + first, begin + last + 1, begin + end);
      renumber(first, end - 1);
    } else {
      const std::int64_t start = beyond > 0 ? to + 1 : to;
      std::rotate(begin + start, begin + first, begin + last + 1);
      renumber(start, last);
    }
  }

  StepCost cost_;
  Neighbours neighbours_;
  std::vector<std::int32_t> dot_at_, place_of_;
  std::vector<bool> is_queued_;
  std::vector<std::int32_t>* next_ = nullptr;
};

}  // namespace

std::vector<std::uint32_t> improved_order(const CellDescription& cell, std::span<const PathDot> path) {
  std::vector<std::uint32_t> order;
  order.reserve(path.size());
  const std::size_t block_count = (path.size() + kBlock - 1) / kBlock;
  for (std::size_t b = 0; b < block_count; ++b) {
    const std::size_t begin = b * path.size() / block_count, end = (b + 1) * path.size() / block_count;
    if (end - begin < 3) {
      for (std::size_t i = begin; i < end; ++i) order.push_back(static_cast<std::uint32_t>(i));
      continue;
    }
    for (const std::int32_t dot : LocalSearch(cell, path.subspan(begin, end - begin)).run())
      order.push_back(static_cast<std::uint32_t>(begin + static_cast<std::size_t>(dot)));
  }
  return order;
}

}  // namespace hilbrush
