#include "sampling/disk/chain.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

namespace hilbrush {
namespace {

/// Points of which the nearest can be found and any be removed: a k-d tree that counts the points left in
/// each part.
class RemovablePoints {
 public:
  explicit RemovablePoints(std::vector<Eigen::Vector3d> points)
      : points_(std::move(points)), order_(points_.size()) {
    std::iota(order_.begin(), order_.end(), 0u);
    place_.resize(points_.size());
    build(0, points_.size());
    for (std::uint32_t i = 0; i < order_.size(); ++i) place_[order_[i]] = i;
  }

  void remove(std::uint32_t point) {
    const std::uint32_t at = place_[point];
    std::size_t node = 0;
    --nodes_[node].left_over;
    while (nodes_[node].child != 0) {
      node = nodes_[node].child + (at >= nodes_[nodes_[node].child].end ? 1u : 0u);
      --nodes_[node].left_over;
    }
    is_gone_.resize(points_.size(), 0);
    is_gone_[point] = 1;
  }

  /// There must be one left.
  std::uint32_t nearest(const Eigen::Vector3d& to) const {
    Best best;
    search(0, to, best);
    return best.point;
  }

 private:
  static constexpr std::size_t kLeafSize = 8;
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};
  struct Node {
    std::size_t begin, end, left_over;
    std::size_t child = 0;  ///< the first of two, or 0
    Eigen::Vector3d low, high;
  };
  struct Best {
    double distance2 = std::numeric_limits<double>::infinity();
    std::uint32_t point = kNone;
  };

  void build(std::size_t begin, std::size_t end) {
    nodes_.push_back(make_node(begin, end));
    for (std::size_t node = 0; node < nodes_.size(); ++node) {
      const std::size_t from = nodes_[node].begin, to = nodes_[node].end;
      if (to - from <= kLeafSize) continue;
      Eigen::Index axis = 0;
      (nodes_[node].high - nodes_[node].low).maxCoeff(&axis);
      const std::size_t middle = from + (to - from) / 2;
      const auto at = [&](std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
      std::nth_element(at(from), at(middle), at(to), [&](std::uint32_t a, std::uint32_t b) {
        return points_[a][axis] != points_[b][axis] ? points_[a][axis] < points_[b][axis] : a < b;
      });
      nodes_[node].child = nodes_.size();
      nodes_.push_back(make_node(from, middle));
      nodes_.push_back(make_node(middle, to));
    }
  }

  Node make_node(std::size_t begin, std::size_t end) const {
    Node node{begin, end, end - begin, 0, points_[order_[begin]], points_[order_[begin]]};
    for (std::size_t i = begin; i < end; ++i) {
      node.low = node.low.cwiseMin(points_[order_[i]]);
      node.high = node.high.cwiseMax(points_[order_[i]]);
    }
    return node;
  }

  double distance2_to(const Node& node, const Eigen::Vector3d& to) const {
    return (node.low - to).cwiseMax(to - node.high).cwiseMax(0).squaredNorm();
  }

  void search(std::size_t index, const Eigen::Vector3d& to, Best& best) const {
    const Node& node = nodes_[index];
    if (node.left_over == 0 || (best.point != kNone && distance2_to(node, to) > best.distance2)) return;
    if (node.child == 0) {
      for (std::size_t i = node.begin; i < node.end; ++i) {
        const std::uint32_t point = order_[i];
        if (!is_gone_.empty() && is_gone_[point]) continue;
        const double distance2 = (points_[point] - to).squaredNorm();
        // Any point is better than none, also at a distance that is infinite or not a number.
        if (best.point == kNone || distance2 < best.distance2 ||
            (distance2 == best.distance2 && point < best.point))
          best = {distance2, point};
      }
      return;
    }
    const bool is_second_nearer =
        distance2_to(nodes_[node.child + 1], to) < distance2_to(nodes_[node.child], to);
    search(node.child + (is_second_nearer ? 1 : 0), to, best);
    search(node.child + (is_second_nearer ? 0 : 1), to, best);
  }

  std::vector<Eigen::Vector3d> points_;
  std::vector<std::uint32_t> order_, place_;
  std::vector<Node> nodes_;
  std::vector<char> is_gone_;
};

/// The corner that the symmetry moves to where `corner` is.
std::size_t corner_before(const Symmetry& symmetry, std::size_t corner) {
  bool x = (corner == 1 || corner == 2) != symmetry.is_mirrored_x,
       y = (corner >= 2) != symmetry.is_mirrored_y;
  if (symmetry.is_swapped) std::swap(x, y);
  return y ? (x ? 2u : 3u) : (x ? 1u : 0u);
}
const Eigen::Vector3d& begin_of(const ChainPiece& piece, const Symmetry& symmetry) {
  return piece.corners_O[corner_before(symmetry, 0)];
}
const Eigen::Vector3d& end_of(const ChainPiece& piece, const Symmetry& symmetry) {
  return piece.corners_O[corner_before(symmetry, piece.end_corner)];
}

constexpr std::size_t kSymmetryCount = 8;
Symmetry symmetry_of(std::size_t index) {
  return {(index & 4u) != 0, (index & 1u) != 0, (index & 2u) != 0};
}
std::size_t symmetry_count(const ChainPiece& piece) {
  return piece.turns == Turns::kNone      ? 1
         : piece.turns == Turns::kMirrors ? kSymmetryCount / 2
                                          : kSymmetryCount;
}

std::vector<std::uint32_t> nearest_next(const std::vector<ChainPiece>& pieces) {
  std::vector<Eigen::Vector3d> corners;
  for (const ChainPiece& piece : pieces)
    corners.insert(corners.end(), piece.corners_O.begin(), piece.corners_O.end());
  RemovablePoints left(std::move(corners));
  std::vector<std::uint32_t> chain;
  for (std::uint32_t piece = 0, corner = 0;;) {
    chain.push_back(piece);
    for (std::uint32_t k = 0; k < 4; ++k) left.remove(4 * piece + k);
    if (chain.size() == pieces.size()) return chain;
    // After a mirror symmetry the end is beside the beginning, or across from it, as it is for corner 0.
    const std::uint32_t end = pieces[piece].end_corner == 1 ? corner ^ 1u : corner ^ 2u;
    const std::uint32_t nearest = left.nearest(pieces[piece].corners_O[end]);
    piece = nearest / 4;
    corner = nearest % 4;
  }
}

}  // namespace

std::vector<ChainLink> chain_pieces(const std::vector<ChainPiece>& pieces) {
  if (pieces.empty()) return {};
  const std::vector<std::uint32_t> order = nearest_next(pieces);
  // Dynamic programming: the shortest path to each symmetry of a piece over all symmetries of the piece
  // before.
  std::vector<std::array<std::uint8_t, kSymmetryCount>> from(order.size());
  std::array<double, kSymmetryCount> length{};
  for (std::size_t i = 1; i < order.size(); ++i) {
    const ChainPiece &last = pieces[order[i - 1]], &piece = pieces[order[i]];
    std::array<double, kSymmetryCount> longer{};
    for (std::size_t s = 0; s < symmetry_count(piece); ++s) {
      longer[s] = std::numeric_limits<double>::infinity();
      for (std::size_t r = 0; r < symmetry_count(last); ++r) {
        const double sum =
            length[r] + (begin_of(piece, symmetry_of(s)) - end_of(last, symmetry_of(r))).norm();
        if (sum >= longer[s]) continue;
        longer[s] = sum;
        from[i][s] = static_cast<std::uint8_t>(r);
      }
    }
    length = longer;
  }
  const auto last_count = static_cast<std::ptrdiff_t>(symmetry_count(pieces[order.back()]));
  auto s = static_cast<std::size_t>(std::min_element(length.begin(), length.begin() + last_count) -
                                    length.begin());
  std::vector<ChainLink> chain(order.size());
  for (std::size_t i = order.size(); i-- > 0;) {
    chain[i] = {order[i], symmetry_of(s)};
    s = from[i][s];
  }
  return chain;
}

double total_jump(const std::vector<ChainPiece>& pieces, const std::vector<ChainLink>& chain) {
  double sum = 0;
  for (std::size_t i = 1; i < chain.size(); ++i)
    sum += (begin_of(pieces[chain[i].piece], chain[i].symmetry) -
            end_of(pieces[chain[i - 1].piece], chain[i - 1].symmetry))
               .norm();
  return sum;
}

}  // namespace hilbrush
