#include "sampling/model/growing_ball.h"

#include <algorithm>
#include <functional>
#include <limits>

namespace hilbrush {
namespace {

double squared_distance(const Eigen::Vector3d& point, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d side = b - a;
  const double along = std::clamp((point - a).dot(side) / side.squaredNorm(), 0., 1.);
  return (a + along * side - point).squaredNorm();
}

}  // namespace

GrowingBall::GrowingBall(const TexturedMesh& mesh, const Neighbors& neighbors)
    : mesh_(mesh), neighbors_(neighbors), entered_(mesh.triangle_count()) {}

void GrowingBall::begin(const Eigen::Vector3d& center_O, std::uint32_t triangle) {
  center_O_ = center_O;
  frontier_.clear();
  if (++round_ == 0) {
    entered_.assign(entered_.size(), {});
    round_ = 1;
  }
  enter({0, triangle});
}

void GrowingBall::enter(const Crossing& crossing) {
  entered_[crossing.triangle] = {crossing.radius2, round_};
  for (std::size_t side = 0; side < 3; ++side) {
    const std::uint32_t next = neighbors_[crossing.triangle][side].triangle;
    if (next == kNoTriangle || entered_[next].round == round_) continue;
    const double radius2 = squared_distance(center_O_, mesh_.corner(crossing.triangle, side),
                                            mesh_.corner(crossing.triangle, (side + 1) % 3));
    frontier_.push_back({std::max(crossing.radius2, radius2), next});
    std::push_heap(frontier_.begin(), frontier_.end(), std::greater<>());
  }
}

double GrowingBall::entry2(std::uint32_t triangle, double within2) {
  while (entered_[triangle].round != round_ && !frontier_.empty() && frontier_.front().radius2 < within2) {
    std::pop_heap(frontier_.begin(), frontier_.end(), std::greater<>());
    const Crossing nearest = frontier_.back();
    frontier_.pop_back();
    if (entered_[nearest.triangle].round != round_) enter(nearest);
  }
  const Entered& entered = entered_[triangle];
  const bool is_within = entered.round == round_ && entered.radius2 < within2;
  return is_within ? entered.radius2 : std::numeric_limits<double>::infinity();
}

}  // namespace hilbrush
