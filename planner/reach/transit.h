#pragma once
#include <optional>
#include <vector>

#include "planner/reach/reach.h"

/// Moves that stay clear of object and table. Each axis runs its own trapezoid, all starting together, as the cell's
/// axes do; between two checks of the clearance nothing can have moved farther than the clearance found (conservative
/// advancement), so nothing is missed.
namespace hilbrush {

class Transit {
 public:
  explicit Transit(const Reach& reach) : reach_(reach) {}

  /// Whether the arm, at rest there, is far enough from everything to go anywhere.
  bool is_clear_at(const Joints& joints) const;
  /// Whether the direct move is clear from start to end.
  bool is_clear(const Joints& from, const Joints& to) const;

  /// Way-points of the first path found to be clear: none (direct, unless the elbow or a winding changes); backing off
  /// along the beam, moving over, coming in along the new beam; the same with the arm lifted; through the home pose.
  /// Nothing if none of these is clear.
  std::optional<std::vector<Joints>> route(const Joints& from, const Joints& to) const;

  /// The same, then a search through the whole joint space: for the few moves that cannot be skipped. Deterministic.
  /// Cost: some 30 ms where there is no path.
  std::optional<std::vector<Joints>> route_by_search(const Joints& from, const Joints& to) const;

 private:
  /// Whether the move does what is never done close to the object: an elbow flip, J4 or C unwinding.
  static bool needs_retract(const Joints& from, const Joints& to);
  std::optional<std::vector<Joints>> search(const Joints& from, const Joints& to) const;
  std::vector<Joints> shortened(std::vector<Joints> path) const;
  /// The tool drawn back along its beam, as far as `distance_m` or the limits allow; nothing if the arm cannot.
  std::optional<Joints> backed_off(const Joints& joints, double distance_m) const;
  Joints lifted(Joints joints) const;
  /// Way-points from a pose outwards, the last with the arm lifted; clear in the direction that they will be used in.
  std::optional<std::vector<Joints>> retreat(const Joints& pose, bool is_outwards) const;
  double least_slack_m(const Joints& from) const;
  bool are_clear(const std::vector<Joints>& path) const;
  /// How far anything on the tool may travel against anything on the table, at most, while the axes move from `a` to
  /// `b`.
  double travel_bound_m(const Joints& a, const Joints& b) const;

  const Reach& reach_;
};

/// Where the axes are `time_s` into a move from rest to rest; each by its own trapezoid.
Joints joints_during(const CellDescription& cell, const Joints& from, const Joints& to, double time_s);

}  // namespace hilbrush
