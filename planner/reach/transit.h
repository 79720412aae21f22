#pragma once
#include <optional>
#include <vector>

#include "planner/reach/reach.h"

/// Moves that stay clear of object and table under every way in which the cell's controllers may lead their
/// joints: see Interpolation, and with either chain late by up to `start_lag_s`. Between two checks of the
/// clearance nothing can have moved farther than the clearance found (conservative advancement), so nothing
/// is missed.
namespace hilbrush {

class Transit {
 public:
  explicit Transit(const Reach& reach) : reach_(reach) {}

  /// Whether the arm, at rest there, is far enough from everything to go anywhere.
  bool is_clear_at(const Joints& joints) const;
  /// Whether the direct move is clear from start to end, whichever of the allowed motions the cell makes.
  bool is_clear(const Joints& from, const Joints& to) const;

  /// Way-points of the first path found to be clear: none (direct, unless the elbow or a winding changes);
  /// backing off along the beam, moving over, coming in along the new beam; the same with the arm lifted;
  /// through the home pose. Nothing if none of these is clear.
  std::optional<std::vector<Joints>> route(const Joints& from, const Joints& to) const;

  /// The same, then a search through the whole joint space: for the few moves that cannot be skipped.
  /// Deterministic. Cost: some 30 ms where there is no path.
  std::optional<std::vector<Joints>> route_by_search(const Joints& from, const Joints& to) const;

 private:
  /// Whether the move does what is never done close to the object: an elbow flip, J4 or C unwinding.
  static bool needs_retract(const Joints& from, const Joints& to);
  std::optional<std::vector<Joints>> search(const Joints& from, const Joints& to) const;
  std::vector<Joints> shortened(std::vector<Joints> path) const;
  /// The tool drawn back along its beam, as far as `distance_m` or the limits allow; nothing if the arm
  /// cannot.
  std::optional<Joints> backed_off(const Joints& joints, double distance_m) const;
  Joints lifted(Joints joints) const;
  /// Way-points from a pose outwards, the last with the arm lifted; clear in the direction that they will be
  /// used in.
  std::optional<std::vector<Joints>> retreat(const Joints& pose, bool is_outwards) const;
  /// What a move may come near to: `refused_m` where it is looked at, `kept_m` for certain between.
  struct Limits {
    double refused_m, kept_m;
  };
  Limits limits_from(double slack_m) const;
  double slack_m(const Joints& joints) const {
    return reach_.clearance().slack_m(reach_.kinematics(), joints);
  }
  class Leg;
  bool are_clear(const std::vector<Joints>& path) const;
  /// How far anything on the tool may travel against anything on the table, at most, while the axes move from
  /// `a` to `b`, none of them back: the arm's part, and the table's. Under one law the joints are ahead or
  /// behind together.
  double arm_travel_bound_m(const Joints& a, const Joints& b, bool is_one_law = true) const;
  double table_travel_bound_m(const Joints& a, const Joints& b) const;

  const Reach& reach_;
};

}  // namespace hilbrush
