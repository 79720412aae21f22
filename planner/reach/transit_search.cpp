#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "planner/cell_model/time_model.h"
#include "planner/reach/transit.h"

/// The last resort of Transit: RRT-connect (Kuffner and LaValle 2000) in the six joints. What differs: edges
/// are whole moves, each checked as the axes will really run it, which differs between the two directions;
/// and samples are drawn near the two ends too, where the tool may have to leave a narrow place.
namespace hilbrush {
namespace {

constexpr int kMaxSamples = 500;
constexpr std::size_t kMaxJoins = 3;  // nodes of the other tree that a new node is joined to

struct Node {
  Joints joints;
  int parent;
};
using Tree = std::vector<Node>;

class Sampler {
 public:
  Sampler(const Kinematics& kinematics, const Joints& from, const Joints& to)
      : kinematics_(kinematics), ends_{from, to}, random_(1) {}

  /// The n-th sample for the tree that grows from end `side`.
  Joints operator()(int n, int side, const Tree& tree) {
    switch (n / 2 % 4) {
      case 0:  // the arm anywhere, rather high
        return anywhere();
      case 1:  // close to the end
        return near(ends_[static_cast<std::size_t>(side)], uniform(.02, .3));
      case 2:  // close to what was reached
        return near(tree[std::uniform_int_distribution<std::size_t>(0, tree.size() - 1)(random_)].joints,
                    uniform(.05, .6));
      default:  // home, with the table as it is at either end
        return at_home();
    }
  }

 private:
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  Joints limited(Joints joints) const {
    for (std::size_t axis = 0; axis < kAxisCount; ++axis)
      joints[axis] = std::clamp(joints[axis], kinematics_.axis_min(axis), kinematics_.axis_max(axis));
    return joints;
  }
  Joints anywhere() {
    Joints joints = ends_[uniform(0, 1) < .5 ? 0 : 1];
    for (const std::size_t axis : {kJ1, kJ2, kJ3, kJ4}) {
      const double low = kinematics_.axis_min(axis);
      const double high = kinematics_.axis_max(axis);
      joints[axis] = axis == kJ3 ? high - (high - low) * std::pow(uniform(0, 1), 2) : uniform(low, high);
    }
    return joints;
  }
  Joints near(Joints joints, double spread) {
    for (const std::size_t axis : {kJ1, kJ2, kJ4, kTilt, kRotation}) joints[axis] += spread * uniform(-1, 1);
    joints[kJ3] += .3 * spread * uniform(-.5, 1);
    return limited(joints);
  }
  Joints at_home() {
    Joints joints = ends_[uniform(0, 1) < .5 ? 0 : 1];
    for (const std::size_t axis : {kJ1, kJ2, kJ3, kJ4}) joints[axis] = kinematics_.cell().axes[axis].home;
    return limited(joints);
  }

  const Kinematics& kinematics_;
  const std::array<Joints, 2> ends_;
  std::mt19937 random_;
};

/// The nodes of the tree that take the least time to reach, nearest first.
std::vector<int> nearest(const CellDescription& cell, const Tree& tree, const Joints& joints,
                         std::size_t count) {
  std::vector<std::pair<double, int>> by_time;
  for (std::size_t i = 0; i < tree.size(); ++i)
    by_time.emplace_back(move_s(cell, tree[i].joints, joints), static_cast<int>(i));
  count = std::min(count, by_time.size());
  std::partial_sort(by_time.begin(), by_time.begin() + static_cast<std::ptrdiff_t>(count), by_time.end());
  std::vector<int> indices;
  for (std::size_t i = 0; i < count; ++i) indices.push_back(by_time[i].second);
  return indices;
}

Joints interpolated(const Joints& from, const Joints& to, double share) {
  Joints joints;
  for (std::size_t i = 0; i < kAxisCount; ++i) joints[i] = from[i] + share * (to[i] - from[i]);
  return joints;
}

}  // namespace

/// Removes way-points that are not needed.
std::vector<Joints> Transit::shortened(std::vector<Joints> path) const {
  for (std::size_t i = 0; i + 2 < path.size(); ++i)
    for (std::size_t j = path.size() - 1; j > i + 1; --j) {
      if ((i == 0 || j + 1 == path.size()) && needs_retract(path[i], path[j])) continue;
      if (!is_clear(path[i], path[j])) continue;
      path.erase(path.begin() + static_cast<std::ptrdiff_t>(i) + 1,
                 path.begin() + static_cast<std::ptrdiff_t>(j));
      break;
    }
  return path;
}

std::optional<std::vector<Joints>> Transit::search(const Joints& from, const Joints& to) const {
  if (!is_clear_at(to)) return std::nullopt;
  std::array<Tree, 2> trees{Tree{{from, -1}}, Tree{{to, -1}}};
  Sampler sampler(reach_.kinematics(), from, to);
  const auto is_passable = [&](const Joints& a, const Joints& b, bool meets_end) {
    return !(meets_end && needs_retract(a, b)) && is_clear(a, b);
  };
  for (int n = 0; n < kMaxSamples; ++n) {
    const int side = n & 1;
    Tree& tree = trees[static_cast<std::size_t>(side)];
    const Tree& other = trees[static_cast<std::size_t>(1 - side)];
    const Joints sample = sampler(n, side, tree);
    const int parent = nearest(reach_.cell(), tree, sample, 1).front();
    const Joints& start = tree[static_cast<std::size_t>(parent)].joints;
    const auto grown = [&]() -> std::optional<Joints> {
      for (const double share : {1., .5, .2}) {
        const Joints reached = interpolated(start, sample, share);
        if (!reach_.kinematics().limit_excess(reached).is_inside()) continue;
        if (side == 0 ? is_passable(start, reached, parent == 0) : is_passable(reached, start, parent == 0))
          return reached;
      }
      return std::nullopt;
    }();
    if (!grown) continue;
    const int index = static_cast<int>(tree.size());
    tree.push_back({*grown, parent});
    for (const int there : nearest(reach_.cell(), other, *grown, kMaxJoins)) {
      const Joints& meeting = other[static_cast<std::size_t>(there)].joints;
      if (side == 0 ? !is_passable(*grown, meeting, there == 0) : !is_passable(meeting, *grown, there == 0))
        continue;
      std::vector<Joints> path;
      for (int i = side == 0 ? index : there; i >= 0; i = trees[0][static_cast<std::size_t>(i)].parent)
        path.push_back(trees[0][static_cast<std::size_t>(i)].joints);
      std::reverse(path.begin(), path.end());
      for (int i = side == 0 ? there : index; i >= 0; i = trees[1][static_cast<std::size_t>(i)].parent)
        path.push_back(trees[1][static_cast<std::size_t>(i)].joints);
      path = shortened(std::move(path));
      return std::vector<Joints>(path.begin() + 1, path.end() - 1);
    }
  }
  return std::nullopt;
}

std::optional<std::vector<Joints>> Transit::route_by_search(const Joints& from, const Joints& to) const {
  if (auto path = route(from, to)) return path;
  return search(from, to);
}

}  // namespace hilbrush
