#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "planner/poses/posed_dots.h"

/// Beam directions in O that many dots share. With the beam's direction fixed in O, neither table nor yaw has
/// to move between the dots that share it, and the arm carries the focus from one to the next. How many
/// directions are used, and which, is a facility location problem: a direction costs a re-pose of the table,
/// a dot costs the time that its incidence is rated at. Solved greedily with exchanges on a sample of dots
/// spread along the curve; then each dot is assigned to one of the directions.
namespace hilbrush {

/// The dots that poses are searched for, and reach to test poses with. Thread-safe.
class DotsToPose {
 public:
  DotsToPose(const Reach& reach, const DotSequence& dots, std::span<const std::uint32_t> dot_indices)
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
struct PoseCosts {
  double incidence_s = 0;  ///< of a dot at 20 degrees; grows with the square
  double repose_s = 0;     ///< of one more direction: a re-pose of the table
  double switch_s = 0;  ///< of a change of direction from one dot of the curve to the next: it splits a tour
  double spacing = 0;   ///< rad, between the candidate directions
  std::size_t sample = 0;  ///< dots by which the directions are chosen
  std::size_t kicks = 0;   ///< per dot, see ordering.h
};
PoseCosts pose_costs(const PlanOptions& options);
double incidence_cost_s(const PoseCosts& costs, double cosine);
/// The preferred incidence that is kept: never less than the spacing of the candidate directions allows.
double kept_incidence(const PlanOptions& options);

constexpr std::uint16_t kNoBeam = UINT16_MAX;

struct SharedBeams {
  std::vector<Eigen::Vector3d> beams_O;
  std::vector<std::uint16_t>
      of_dot;  ///< index into beams_O; kNoBeam: none within the preferred incidence is clear
};

/// Cost: O(sample * candidates + dots * directions) with a few clearance tests a dot, in parallel; 2 bytes a
/// dot. The same for any number of threads.
SharedBeams choose_shared_beams(const DotsToPose& dots, const PoseCosts& costs,
                                const Progress& progress = {});

}  // namespace hilbrush
