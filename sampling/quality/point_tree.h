#pragma once
#include <tbb/parallel_invoke.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

/// Points in a balanced tree of tight boxes: counts within shapes and nearest points, for plane and space
/// alike.
namespace hilbrush {

/// How much of a box is inside a shape.
enum class Overlap { kOutside, kInside, kPartly };

template <int kDimension>
class PointTree {
 public:
  using Point = Eigen::Matrix<double, kDimension, 1>;
  using Box = Eigen::AlignedBox<double, kDimension>;

  struct Nearest {
    std::uint32_t index = kNone;  ///< into the points given
    double distance = std::numeric_limits<double>::infinity();
  };
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};

  /// Copies the points. Cost O(n log n), parallel; the same tree for any number of threads.
  explicit PointTree(std::span<const Point> points) {
    entries_.resize(points.size());
    for (std::uint32_t i = 0; i < points.size(); ++i) entries_[i] = {points[i], i};
    std::size_t leaf_count = 1;
    while (leaf_count * kLeafSize < points.size()) leaf_count *= 2;
    boxes_.resize(2 * leaf_count - 1);
    build(0, 0, entries_.size());
  }

  std::size_t size() const { return entries_.size(); }

  /// The number of points inside `shape`, which has `overlap(box)` and `contains(point)`. Cost O(sqrt n) in
  /// the plane, O(n^2/3) in space, if the shape's border is short.
  template <class Shape>
  std::size_t count(const Shape& shape) const {
    return entries_.empty() ? 0 : count_below(shape, 0, 0, entries_.size());
  }

  /// The nearest point among those for which `accept(index)` is true.
  template <class Accept>
  Nearest nearest(const Point& place, Accept&& accept) const {
    return cheapest(place, [&accept](std::uint32_t index, double distance2, double) {
      return accept(index) ? distance2 : std::numeric_limits<double>::infinity();
    });
  }

  /// The point with the least cost2(index, squared distance, least so far). A cost must not be less than the
  /// squared distance, because it is asked for only where that is less than the least cost so far. The square
  /// root of the cost is returned as the distance.
  template <class Cost>
  Nearest cheapest(const Point& place, Cost&& cost2) const {
    Nearest best;
    if (!entries_.empty()) search(place, cost2, 0, 0, entries_.size(), best);
    best.distance = std::sqrt(best.distance);
    return best;
  }

  /// Calls visit(index, place) for each point within `radius` of `center`, in the order of the tree.
  template <class Visit>
  void visit_near(const Point& center, double radius, Visit&& visit) const {
    if (!entries_.empty()) visit_below(center, radius * radius, visit, 0, 0, entries_.size());
  }

 private:
  static constexpr std::size_t kLeafSize = 8;

  struct Entry {
    Point place;
    std::uint32_t index;
  };

  bool is_leaf(std::size_t node) const { return 2 * node + 1 >= boxes_.size(); }

  void build(std::size_t node, std::size_t begin, std::size_t end) {
    Box box;
    for (std::size_t i = begin; i < end; ++i) box.extend(entries_[i].place);
    boxes_[node] = box;
    if (is_leaf(node)) return;
    const std::size_t middle = begin + (end - begin) / 2;
    if (begin < end) {
      int axis = 0;
      box.sizes().maxCoeff(&axis);
      // Equal coordinates in the order given, so that the tree does not depend on how the library selects.
      std::nth_element(
          entries_.begin() + static_cast<std::ptrdiff_t>(begin),
          entries_.begin() + static_cast<std::ptrdiff_t>(middle),
          entries_.begin() + static_cast<std::ptrdiff_t>(end), [axis](const Entry& a, const Entry& b) {
            return a.place[axis] < b.place[axis] || (a.place[axis] == b.place[axis] && a.index < b.index);
          });
    }
    const auto lower = [&] { build(2 * node + 1, begin, middle); };
    const auto upper = [&] { build(2 * node + 2, middle, end); };
    if (end - begin > 4096) {
      tbb::parallel_invoke(lower, upper);
    } else {
      lower();
      upper();
    }
  }

  template <class Shape>
  std::size_t count_below(const Shape& shape, std::size_t node, std::size_t begin, std::size_t end) const {
    if (begin == end) return 0;
    switch (shape.overlap(boxes_[node])) {
      case Overlap::kOutside:
        return 0;
      case Overlap::kInside:
        return end - begin;
      case Overlap::kPartly:
        break;
    }
    if (is_leaf(node)) {
      std::size_t count = 0;
      for (std::size_t i = begin; i < end; ++i) count += shape.contains(entries_[i].place) ? 1 : 0;
      return count;
    }
    const std::size_t middle = begin + (end - begin) / 2;
    return count_below(shape, 2 * node + 1, begin, middle) + count_below(shape, 2 * node + 2, middle, end);
  }

  /// Until it returns to cheapest(), `best.distance` is squared.
  template <class Cost>
  void search(const Point& place, Cost& cost2, std::size_t node, std::size_t begin, std::size_t end,
              Nearest& best) const {
    if (is_leaf(node)) {
      for (std::size_t i = begin; i < end; ++i) {
        const double distance = (entries_[i].place - place).squaredNorm();
        if (!(distance < best.distance)) continue;
        const double cost = cost2(entries_[i].index, distance, best.distance);
        if (cost < best.distance) best = {entries_[i].index, cost};
      }
      return;
    }
    const std::size_t middle = begin + (end - begin) / 2;
    const std::array<double, 2> far{
        begin == middle ? best.distance : boxes_[2 * node + 1].squaredExteriorDistance(place),
        boxes_[2 * node + 2].squaredExteriorDistance(place)};
    const std::size_t first = far[1] < far[0] ? 1 : 0;
    for (const std::size_t side : {first, 1 - first}) {
      if (!(far[side] < best.distance)) continue;
      search(place, cost2, 2 * node + 1 + side, side == 0 ? begin : middle, side == 0 ? middle : end, best);
    }
  }

  template <class Visit>
  void visit_below(const Point& center, double radius2, Visit& visit, std::size_t node, std::size_t begin,
                   std::size_t end) const {
    if (begin == end || boxes_[node].squaredExteriorDistance(center) > radius2) return;
    if (is_leaf(node)) {
      for (std::size_t i = begin; i < end; ++i)
        if ((entries_[i].place - center).squaredNorm() <= radius2)
          visit(entries_[i].index, entries_[i].place);
      return;
    }
    const std::size_t middle = begin + (end - begin) / 2;
    visit_below(center, radius2, visit, 2 * node + 1, begin, middle);
    visit_below(center, radius2, visit, 2 * node + 2, middle, end);
  }

  std::vector<Entry> entries_;
  std::vector<Box> boxes_;  ///< a heap: the children of node n are 2n + 1 and 2n + 2
};

/// The points within a distance of a center.
template <int kDimension>
struct Ball {
  using Point = Eigen::Matrix<double, kDimension, 1>;
  Point center;
  double radius = 0;

  Overlap overlap(const Eigen::AlignedBox<double, kDimension>& box) const {
    if (box.squaredExteriorDistance(center) >= radius * radius) return Overlap::kOutside;
    const Point far = (center - box.min()).cwiseMax(box.max() - center);
    return far.squaredNorm() < radius * radius ? Overlap::kInside : Overlap::kPartly;
  }
  bool contains(const Point& p) const { return (p - center).squaredNorm() < radius * radius; }
};

/// The points on the inner side of some lines or planes: normal . p > offset for all of them.
template <int kDimension, int kCount>
struct HalfSpaces {
  using Point = Eigen::Matrix<double, kDimension, 1>;
  std::array<Point, kCount> normals;
  std::array<double, kCount> offsets{};

  Overlap overlap(const Eigen::AlignedBox<double, kDimension>& box) const {
    Overlap result = Overlap::kInside;
    for (std::size_t k = 0; k < kCount; ++k) {
      const double middle = normals[k].dot(box.center()) - offsets[k];
      const double reach = .5 * normals[k].cwiseAbs().dot(box.sizes());
      if (middle + reach <= 0) return Overlap::kOutside;
      // Boxes that touch a plane within rounding count as partly inside, so their points are tested one by
      // one.
      if (middle - reach <= 1e-12 * normals[k].norm()) result = Overlap::kPartly;
    }
    return result;
  }
  bool contains(const Point& p) const {
    for (std::size_t k = 0; k < kCount; ++k)
      if (!(normals[k].dot(p) > offsets[k])) return false;
    return true;
  }
};

}  // namespace hilbrush
