#pragma once
#include <optional>
#include <span>
#include <vector>

#include "planner/reach.h"

/// A pose for each dot, in order. The table is held while dots can be exposed near their normals, by yaw alone; where
/// that ends, it is posed anew so that the new pose serves many of the coming dots for the time the move takes.
namespace hilbrush {

/// A dot that reach has found a pose for.
struct ReachableDot {
  Target target;
  double cos_allowed = 1;  ///< of the incidence against the smooth normal that pose_search may use
};

class PoseSearch {
 public:
  PoseSearch(const Reach::Implementation& reach, std::span<const ReachableDot> dots) : reach_(reach), dots_(dots) {}

  /// The pose for dot `i` with the table and elbow of `now`, near its yaw; nothing if there is none within the dot's
  /// allowed incidence.
  std::optional<DotPose> hold(const DotPose& now, std::size_t i) const;

  /// New poses for dot `i`, best first: least move time for each dot that they will serve. Never empty for a reachable
  /// dot.
  std::vector<DotPose> repose(const DotPose& now, std::size_t i) const;

 private:
  struct Candidate {
    DotPose pose;
    double overhead_s = 0;  ///< move time for each dot served
  };
  std::vector<Candidate> propose(const DotPose& now, std::size_t i) const;
  std::size_t served_at_most(const TablePose& table, std::size_t i) const;
  std::size_t served(const DotPose& pose, std::size_t i, std::size_t limit) const;
  bool is_allowed(const TablePose& table, double yaw, std::size_t i) const;
  std::optional<DotPose> pose_at(const DotPose& now, double yaw, std::size_t i) const;
  double repose_s(const DotPose& from, const DotPose& to) const;

  const Reach::Implementation& reach_;
  std::span<const ReachableDot> dots_;
};

}  // namespace hilbrush
