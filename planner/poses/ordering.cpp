#include "planner/poses/ordering.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

namespace hilbrush {
namespace {

constexpr std::size_t kNeighbors = 8;
constexpr std::int64_t kWindow = 5000;  // positions that one move may shift or reverse
constexpr std::int64_t kKickWindow = 1000;
constexpr std::size_t kTourBlock = 1 << 15;  // dots that are improved together
constexpr std::int32_t kNone = -1;           // beyond an end of the path
constexpr float kMinGainS = 1e-6F;
/// The share of the time saved by turning the tool that is counted: turns add up, so not all of it can be
/// realized.
constexpr float kTurnShare = .7F;

/// The cost of a step; beyond the ends of the path there is none.
class PathCost {
 public:
  PathCost(const CellDescription& cell, std::span<const PathDot> path) : path_(path), step_(cell) {}

  float operator()(std::int32_t a, std::int32_t b,
                   float enough_s = std::numeric_limits<float>::infinity()) const {
    if (a == kNone || b == kNone) return 0;
    const PathDot &from = path_[static_cast<std::size_t>(a)], &to = path_[static_cast<std::size_t>(b)];
    return step_.with_turn(from.arm, to.arm, from.per_yaw, to.per_yaw, kTurnShare, enough_s);
  }

 private:
  std::span<const PathDot> path_;
  StepCost step_;
};

struct Neighbor {
  std::int32_t dot;
  float step_s;  ///< cost of the step there, kept because it is needed often
};

/// The nearest dots of each dot, by a hash-free grid: dots sorted by cell.
class Neighbors {
 public:
  Neighbors(std::span<const PathDot> path, const PathCost& cost) : path_(path) {
    const std::size_t n = path.size();
    Eigen::Array3f low = path[0].position_O.array();
    Eigen::Array3f high = low;
    std::vector<float> steps;
    for (std::size_t i = 0; i < n; ++i) {
      low = low.min(path[i].position_O.array());
      high = high.max(path[i].position_O.array());
      if (i > 0) steps.push_back((path[i].position_O - path[i - 1].position_O).norm());
    }
    std::nth_element(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2),
                     steps.end());
    low_ = low;
    const float extent = (high - low).maxCoeff();
    size_ = std::max({2 * steps[steps.size() / 2], extent / 1000, 1e-7F});
    count_ = ((high - low) / size_).cast<std::int64_t>() + 1;
    order_.resize(n);
    std::iota(order_.begin(), order_.end(), 0);
    std::vector<std::int64_t> keys(n);
    for (std::size_t i = 0; i < n; ++i) keys[i] = key(cell_of(i));
    std::sort(order_.begin(), order_.end(), [&](std::int32_t a, std::int32_t b) {
      const auto ka = keys[static_cast<std::size_t>(a)];
      const auto kb = keys[static_cast<std::size_t>(b)];
      return ka != kb ? ka < kb : a < b;
    });
    keys_.resize(n);
    for (std::size_t i = 0; i < n; ++i) keys_[i] = keys[static_cast<std::size_t>(order_[i])];
    find_all(cost);
  }

  std::span<const Neighbor> of(std::int32_t dot) const {
    const std::size_t i = static_cast<std::size_t>(dot);
    return {near_.data() + first_[i], first_[i + 1] - first_[i]};
  }

 private:
  using Cell = Eigen::Array<std::int64_t, 3, 1>;
  Cell cell_of(std::size_t i) const {
    return ((path_[i].position_O.array() - low_) / size_).cast<std::int64_t>().min(count_ - 1);
  }
  std::int64_t key(const Cell& cell) const { return (cell[2] * count_[1] + cell[1]) * count_[0] + cell[0]; }

  void find_all(const PathCost& cost) {
    const std::size_t n = path_.size();
    first_.assign(1, 0);
    near_.reserve(n * kNeighbors);
    std::vector<std::pair<float, std::int32_t>> found;
    for (std::size_t i = 0; i < n; ++i) {
      found.clear();
      collect(i, found);
      const std::size_t kept = std::min(kNeighbors, found.size());
      std::partial_sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(kept), found.end());
      for (std::size_t k = 0; k < kept; ++k)
        near_.push_back({found[k].second, cost(static_cast<std::int32_t>(i), found[k].second)});
      first_.push_back(near_.size());
    }
  }

  /// From the dot's grid cell and those around it.
  void collect(std::size_t i, std::vector<std::pair<float, std::int32_t>>& found) const {
    const Cell cell = cell_of(i);
    const std::int64_t x_low = std::max<std::int64_t>(0, cell[0] - 1);
    const std::int64_t x_high = std::min(count_[0] - 1, cell[0] + 1);
    for (std::int64_t z = cell[2] - 1; z <= cell[2] + 1; ++z)
      for (std::int64_t y = cell[1] - 1; y <= cell[1] + 1; ++y) {
        if (z < 0 || y < 0 || z >= count_[2] || y >= count_[1]) continue;
        // Cells along x follow each other in the sorted keys.
        const auto begin = std::lower_bound(keys_.begin(), keys_.end(), key({x_low, y, z}));
        const auto end = std::upper_bound(begin, keys_.end(), key({x_high, y, z}));
        for (auto it = begin; it != end; ++it) {
          const std::int32_t other = order_[static_cast<std::size_t>(it - keys_.begin())];
          if (static_cast<std::size_t>(other) != i)
            found.emplace_back(
                (path_[i].position_O - path_[static_cast<std::size_t>(other)].position_O).squaredNorm(),
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
  std::vector<Neighbor> near_;
};

/// The path as an array of dots, and its local improvement. Every change of the path is made of reversals of
/// stretches, so that a list of reversals suffices to undo a failed attempt.
class LocalSearch {
 public:
  LocalSearch(const CellDescription& cell, std::span<const PathDot> path)
      : cost_(cell, path),
        neighbors_(path, cost_),
        dot_at_(path.size()),
        place_of_(path.size()),
        is_queued_(path.size(), false) {
    std::iota(dot_at_.begin(), dot_at_.end(), 0);
    std::iota(place_of_.begin(), place_of_.end(), 0);
  }

  void descend() {
    for (const std::int32_t dot : std::vector<std::int32_t>(dot_at_)) queue_again(dot);
    settle(40 * dot_at_.size());  // a bound; a few attempts at each dot are usual
  }

  /// Swaps random neighboring stretches, descends from there, and keeps the result if it is better.
  void perturb(std::size_t kicks) {
    constexpr std::int64_t kMax = 30;
    const auto count = static_cast<std::int64_t>(dot_at_.size());
    if (count < 8) return;
    window_ = kKickWindow;
    is_logging_ = true;
    std::minstd_rand random(1);
    const auto below = [&](std::int64_t bound) {
      return static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(bound));
    };
    for (std::size_t k = 0; k < kicks; ++k) {
      log_.clear();
      gained_s_ = 0;
      const std::int64_t longest = std::min(kMax, count / 3);
      const std::int64_t first = below(count - 2);
      const std::int64_t middle = std::min(first + 1 + below(longest), count - 1);
      const std::int64_t end = std::min(middle + 1 + below(longest), count);
      swap_stretches(first, middle, end);
      settle(1000);
      if (gained_s_ >= -kMinGainS) continue;
      is_logging_ = false;
      for (auto it = log_.rbegin(); it != log_.rend(); ++it) reverse(it->first, it->second);
      is_logging_ = true;
    }
  }

  const std::vector<std::int32_t>& path() const { return dot_at_; }

 private:
  std::int64_t place(std::int32_t dot) const { return place_of_[static_cast<std::size_t>(dot)]; }
  std::int32_t at(std::int64_t place) const {
    return place < 0 || place >= static_cast<std::int64_t>(dot_at_.size())
               ? kNone
               : dot_at_[static_cast<std::size_t>(place)];
  }
  /// Of an edge of the path, which mostly joins neighbors.
  float edge_s(std::int32_t a, std::int32_t b) const {
    if (a == kNone || b == kNone) return 0;
    for (const Neighbor& near : neighbors_.of(a))
      if (near.dot == b) return near.step_s;
    return cost_(a, b);
  }
  void queue_again(std::int32_t dot) {
    if (dot == kNone || is_queued_[static_cast<std::size_t>(dot)]) return;
    is_queued_[static_cast<std::size_t>(dot)] = true;
    queue_.push_back(dot);
  }

  /// Improves around the queued dots until nothing improves, or `max_attempts` have been looked at.
  void settle(std::size_t max_attempts) {
    std::size_t attempts = 0;
    for (std::size_t next = 0; next < queue_.size(); ++next) {
      const std::int32_t dot = queue_[next];
      is_queued_[static_cast<std::size_t>(dot)] = false;
      if (attempts >= max_attempts) continue;
      for (++attempts; two_opt(dot) || move_segment(dot); ++attempts) {
      }
    }
    queue_.clear();
  }

  /// Replaces the edge from `a` to its successor (or predecessor) and one at a neighbor.
  bool two_opt(std::int32_t a) {
    for (const std::int64_t side : {1, -1}) {
      const std::int32_t b = at(place(a) + side);
      const float old_s = edge_s(a, b);
      for (const auto& [c, new_s] : neighbors_.of(a)) {
        if (new_s >= old_s) continue;
        const std::int32_t d = at(place(c) + side);
        const float saved_s = old_s + edge_s(c, d) - new_s;
        const float gain_s = saved_s - cost_(b, d, saved_s);
        if (gain_s <= kMinGainS) continue;
        const std::int64_t first = side > 0 ? std::min(place(a), place(c)) + 1 : std::min(place(a), place(c));
        const std::int64_t last = side > 0 ? std::max(place(a), place(c)) : std::max(place(a), place(c)) - 1;
        if (last - first >= window_) continue;
        reverse(first, last);
        gained_s_ += gain_s;
        for (const std::int32_t end : {a, b, c, d}) queue_again(end);
        return true;
      }
    }
    return false;
  }

  /// Moves one to three dots that begin or end with `a` next to a neighbor of `a`.
  bool move_segment(std::int32_t a) {
    for (const std::int64_t side : {1, -1})
      for (std::int64_t length = side > 0 ? 1 : 2; length <= 3; ++length) {
        const std::int32_t e = at(place(a) + side * (length - 1));  // the segment's other end
        if (e == kNone) break;
        if (move_segment(a, e, side, length)) return true;
      }
    return false;
  }

  bool move_segment(std::int32_t a, std::int32_t e, std::int64_t side, std::int64_t length) {
    const std::int32_t before = at(place(a) - side);
    const std::int32_t after = at(place(e) + side);
    const float old_s = edge_s(before, a) + edge_s(e, after);
    const float removed_s = old_s - cost_(before, after, old_s);
    if (removed_s <= kMinGainS) return false;
    for (const auto& [c, joint_s] : neighbors_.of(a)) {
      if (joint_s >= removed_s) continue;
      const std::int64_t offset = (place(c) - place(a)) * side;
      if ((offset >= 0 && offset < length) || std::abs(offset) >= window_) continue;
      for (const std::int64_t beyond : {1, -1}) {
        const std::int32_t d = at(place(c) + beyond);
        if (d == a || d == e) continue;  // the edge that is taken away
        const float saved_s = removed_s + edge_s(c, d) - joint_s;
        const float gain_s = saved_s - cost_(e, d, saved_s);
        if (gain_s <= kMinGainS) continue;
        insert(a, e, c, beyond);
        gained_s_ += gain_s;
        for (const std::int32_t end : {a, e, before, after, c, d}) queue_again(end);
        return true;
      }
    }
    return false;
  }

  void reverse(std::int64_t first, std::int64_t last) {
    if (first >= last) return;
    if (is_logging_) log_.emplace_back(first, last);
    std::reverse(dot_at_.begin() + first, dot_at_.begin() + last + 1);
    for (std::int64_t p = first; p <= last; ++p)
      place_of_[static_cast<std::size_t>(dot_at_[static_cast<std::size_t>(p)])] =
          static_cast<std::int32_t>(p);
  }

  /// The segment from `a` to `e` goes between `c` and the dot `beyond` it, `a` next to `c`.
  void insert(std::int32_t a, std::int32_t e, std::int32_t c, std::int64_t beyond) {
    const std::int64_t first = std::min(place(a), place(e));
    const std::int64_t last = std::max(place(a), place(e));
    const std::int64_t to = place(c);
    // Reading along the path, a segment put behind c begins with a; one put before c ends with it.
    const bool keeps_direction = (place(a) <= place(e)) == (beyond > 0);
    // One reversal swaps the segment with what it passes; each is then reversed again if needed.
    const std::int64_t length = last - first + 1;
    if (to > last) {
      const std::int64_t end = beyond > 0 ? to : to - 1;
      reverse(first, end);
      reverse(first, end - length);
      if (keeps_direction) reverse(end - length + 1, end);
    } else {
      const std::int64_t start = beyond > 0 ? to + 1 : to;
      reverse(start, last);
      reverse(start + length, last);
      if (keeps_direction) reverse(start, start + length - 1);
    }
  }

  /// The places [first, middle) and [middle, end).
  void swap_stretches(std::int64_t first, std::int64_t middle, std::int64_t end) {
    const std::int32_t a = at(first - 1);
    const std::int32_t b = at(first);
    const std::int32_t c = at(middle - 1);
    const std::int32_t d = at(middle);
    const std::int32_t e = at(end - 1);
    const std::int32_t f = at(end);
    gained_s_ += cost_(a, b) + cost_(c, d) + cost_(e, f) - cost_(a, d) - cost_(e, b) - cost_(c, f);
    reverse(first, end - 1);
    reverse(first, first + (end - middle) - 1);
    reverse(first + (end - middle), end - 1);
    for (const std::int32_t dot : {a, b, c, d, e, f}) queue_again(dot);
  }

  PathCost cost_;
  Neighbors neighbors_;
  std::vector<std::int32_t> dot_at_, place_of_;
  std::vector<bool> is_queued_;
  std::vector<std::int32_t> queue_;
  std::int64_t window_ = kWindow;
  float gained_s_ = 0;
  bool is_logging_ = false;
  std::vector<std::pair<std::int64_t, std::int64_t>> log_;  ///< reversals since the last kick
};

}  // namespace

std::vector<std::uint32_t> improved_order(const CellDescription& cell, std::span<const PathDot> path,
                                          std::size_t kicks) {
  std::vector<std::uint32_t> order;
  order.reserve(path.size());
  const std::size_t block_count = (path.size() + kTourBlock - 1) / kTourBlock;
  for (std::size_t b = 0; b < block_count; ++b) {
    const std::size_t begin = b * path.size() / block_count;
    const std::size_t end = (b + 1) * path.size() / block_count;
    if (end - begin < 3) {
      for (std::size_t i = begin; i < end; ++i) order.push_back(static_cast<std::uint32_t>(i));
      continue;
    }
    LocalSearch search(cell, path.subspan(begin, end - begin));
    search.descend();
    search.perturb(kicks * (end - begin));
    for (const std::int32_t dot : search.path())
      order.push_back(static_cast<std::uint32_t>(begin + static_cast<std::size_t>(dot)));
  }
  return order;
}

}  // namespace hilbrush
