#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "planner/poses/posed_dots.h"

/// Aims: beam directions in O that many dots share. With the beam's direction fixed in O, neither table nor yaw has to
/// move between the dots of an aim, and the arm carries the focus from one to the next. How many aims there are, and
/// which, is a facility location problem: an aim costs a re-pose of the table, a dot costs what its incidence is held
/// to be worth. Solved greedily with exchanges on dots spread along the curve; then all dots choose among the aims.
namespace hilbrush {

/// The dots that poses are looked for, and what may be done to them. Thread-safe.
class AimedDots {
 public:
  AimedDots(const Reach& reach, const DotSequence& dots, std::span<const std::uint32_t> dot_indices)
      : reach_(reach), dots_(dots), dot_indices_(dot_indices) {}

  std::size_t size() const { return dot_indices_.size(); }
  std::uint32_t dot_index(std::size_t i) const { return dot_indices_[i]; }
  Target target(std::size_t i) const { return target_of(dots_.dots[dot_indices_[i]]); }
  const Eigen::Vector3d& position_O(std::size_t i) const { return dots_.dots[dot_indices_[i]].position_O; }
  const Reach& reach() const { return reach_; }

 private:
  const Reach& reach_;
  const DotSequence& dots_;
  std::span<const std::uint32_t> dot_indices_;
};

/// What planning trades, in seconds.
struct AimCosts {
  double incidence_s = 0;  ///< of a dot at 20 degrees; grows with the square
  double aim_s = 0;        ///< of one more aim: a re-pose
  double switch_s = 0;     ///< of another aim from one dot of the curve to the next: a tour that is torn
  double spacing = 0;      ///< rad, between the directions to choose from
  std::size_t sample = 0;  ///< dots that are asked
  std::size_t kicks = 0;   ///< a dot, see ordering.h
};
AimCosts aim_costs(const PlanOptions& options);
double incidence_cost_s(const AimCosts& costs, double cosine);
/// The preferred incidence that is kept: never less than what the directions to choose from are apart.
double kept_incidence(const PlanOptions& options);

constexpr std::uint16_t kNoAim = UINT16_MAX;

struct Aims {
  std::vector<Eigen::Vector3d> beams_O;
  std::vector<std::uint16_t> of_dot;  ///< index into beams_O or kNoAim: no aim within the preferred incidence is clear
};

/// Cost: O(sample * directions + dots * aims) with a few clearance tests a dot, in parallel; 2 bytes a dot. The same
/// for any number of threads.
Aims choose_aims(const AimedDots& dots, const AimCosts& costs, const Progress& progress = {});

}  // namespace hilbrush
