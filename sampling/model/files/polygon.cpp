#include "sampling/model/files/polygon.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace hilbrush {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Corner tests in all polygons of one cutter; they take about a second.
constexpr std::size_t kWorkLimit = 200'000'000;
/// Twice the area of an ear over the squared extent of its polygon: flatter ears are cut last.
constexpr double kFlatTurn = 1e-9;

double turn(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

bool is_inside(const Vector2d& p, const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  return turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0;
}

}  // namespace

void PolygonCutter::project(const std::vector<Vector3d>& corners) {
  // Relative to the first corner, so that a polygon far from the origin keeps its digits.
  Vector3d normal = Vector3d::Zero();
  const Vector3d& origin = corners[0];
  for (std::size_t i = 0; i < corners.size(); ++i)
    normal += (corners[i] - origin).cross(corners[(i + 1) % corners.size()] - origin);
  int axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  // Along the largest component; swapped where needed so that the polygon runs counter-clockwise.
  const int x = normal[axis] >= 0 ? (axis + 1) % 3 : (axis + 2) % 3;
  const int y = normal[axis] >= 0 ? (axis + 2) % 3 : (axis + 1) % 3;
  flat_.clear();
  double extent = 0;
  for (const Vector3d& corner : corners) {
    flat_.emplace_back(corner[x] - origin[x], corner[y] - origin[y]);
    extent = std::max(extent, flat_.back().squaredNorm());
  }
  min_turn_ = kFlatTurn * extent;
}

bool PolygonCutter::is_convex() const {
  const std::size_t n = flat_.size();
  double total_turn = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const Vector2d& a = flat_[i];
    const Vector2d& b = flat_[(i + 1) % n];
    const Vector2d& c = flat_[(i + 2) % n];
    // A fan over a flat corner would have a triangle without area, and a hole once that is dropped.
    if (!(turn(a, b, c) > min_turn_)) return false;
    const Vector2d u = b - a;
    const Vector2d v = c - b;
    total_turn += std::atan2(u.x() * v.y() - u.y() * v.x(), u.dot(v));
  }
  // A star turns the same way everywhere, but more than once around.
  return total_turn < 7;
}

const std::vector<PolygonCutter::Triangle>& PolygonCutter::cut(const std::vector<Vector3d>& corners) {
  triangles_.clear();
  if (corners.size() < 3) return triangles_;
  if (corners.size() == 3) {
    triangles_.push_back({0, 1, 2});
    return triangles_;
  }
  project(corners);
  const std::size_t n = corners.size();
  next_.resize(n);
  previous_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    next_[i] = (i + 1) % n;
    previous_[i] = (i + n - 1) % n;
  }
  if (is_convex())
    fan_rest(0, n);
  else
    cut_ears();
  return triangles_;
}

bool PolygonCutter::is_ear(std::size_t corner) const {
  const Vector2d& a = flat_[previous_[corner]];
  const Vector2d& b = flat_[corner];
  const Vector2d& c = flat_[next_[corner]];
  if (!(turn(a, b, c) > min_turn_)) return false;
  for (const std::size_t other : reflex_) {
    const Vector2d& p = flat_[other];
    ++work_;
    // A corner that coincides with one of the ear's does not block it: bridges to holes visit a point twice.
    if (p != a && p != b && p != c && is_inside(p, a, b, c)) return false;
  }
  return true;
}

void PolygonCutter::cut_ears() {
  const auto is_reflex = [&](std::size_t i) {
    return !(turn(flat_[previous_[i]], flat_[i], flat_[next_[i]]) > 0);
  };
  reflex_.clear();
  for (std::size_t i = 0; i < flat_.size(); ++i)
    if (is_reflex(i)) reflex_.push_back(i);

  std::size_t count = flat_.size();
  std::size_t corner = 0;
  std::size_t misses = 0;
  while (count > 3) {
    if (work_ > kWorkLimit) {
      ++given_up_;
      break;
    }
    if (misses > count) {
      if (min_turn_ == 0) break;
      min_turn_ = 0;
      misses = 0;
    }
    if (!is_ear(corner)) {
      corner = next_[corner];
      ++misses;
      continue;
    }
    triangles_.push_back({previous_[corner], corner, next_[corner]});
    next_[previous_[corner]] = next_[corner];
    previous_[next_[corner]] = previous_[corner];
    --count;
    misses = 0;
    // Only the two neighbors change, and a convex corner never turns reflex by cutting an ear.
    work_ += reflex_.size();
    std::erase_if(reflex_, [&](std::size_t i) {
      return (i == previous_[corner] || i == next_[corner]) && !is_reflex(i);
    });
    corner = next_[next_[corner]];
  }
  fan_rest(corner, count);
}

void PolygonCutter::fan_rest(std::size_t start, std::size_t count) {
  std::size_t corner = next_[start];
  for (std::size_t i = 2; i < count; ++i, corner = next_[corner])
    triangles_.push_back({start, corner, next_[corner]});
}

}  // namespace hilbrush
