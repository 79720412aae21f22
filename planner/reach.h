#pragma once
#include <optional>
#include <vector>

#include "planner/clearance.h"
#include "planner/plan.h"

/// Inside planner/: what Reach knows, and the search for any pose at all that exposes one dot.
namespace hilbrush {

/// One way to expose a dot.
struct DotPose {
  TablePose table;
  double yaw = 0;
  Elbow elbow = Elbow::kPositive;
  Joints joints{};         ///< J4 and C wound nearest to the reference
  double from_smooth = 0;  ///< rad, between the beam and the smooth normal
};

/// A dot as reach looks at it.
struct Target {
  Eigen::Vector3d position_O, face_normal_O, smooth_normal_O;
};

struct Reach::Implementation {
  Implementation(const TexturedMesh& mesh, const CellDescription& cell, const PlanOptions& options);

  CellDescription cell;
  PlanOptions options;
  Kinematics kinematics;
  Clearance clearance;
  double object_radius_m;  ///< of object and plate around the tilt axis
  double object_turn_m;    ///< ... and around C

  /// Some pose within the cone around the face normal, as near to the smooth normal as a coarse set of directions
  /// allows. Depends on nothing but the target (and, for windings, the reference). If there is none, `skipped`
  /// (optional) gets reason and detail.
  std::optional<DotPose> find_pose(const Target& target, const Joints& reference, SkippedDot* skipped = nullptr) const;

  /// The pose that brings this beam to the dot, if table, arm and quill agree; the beam and the lens were found clear
  /// before.
  std::optional<DotPose> pose_for_beam(const Target& target, const Eigen::Vector3d& beam_O, const Joints& reference,
                                       class FailureTally* tally) const;
  /// The arm's part of it, on a table that is already chosen. Limits and the quill are looked at, not the lens.
  bool arm_fits(const TablePose& table, const Eigen::Vector3d& position_O, double yaw, Elbow elbow,
                const Joints& reference, Joints& joints, FailureTally* tally) const;

  const std::vector<double>& tilts() const { return tilts_; }
  /// The cone's limit against the face normal, a hair inside what was asked for.
  double cos_max_incidence() const { return cos_max_incidence_; }

 private:
  double cos_max_incidence_;
  std::vector<Eigen::Vector3d> cone_, fine_cone_;  ///< unit, around +z, nearest first
  std::vector<double> tilts_;
};

/// Yaws (two, mirror images) and the rotation that make the beam's direction in O `beam_O` at this tilt.
struct TableSolution {
  double yaw, rotation;
};
int solve_table(const Kinematics& kinematics, double tilt, const Eigen::Vector3d& beam_O, TableSolution* solutions);

/// Keeps the best excuse: the one of the candidate that came farthest.
class FailureTally {
 public:
  void beam(Obstruction what, double free_m);
  void lens(Obstruction what);
  void quill(Obstruction what);
  void no_tilt();
  void limit(const LimitExcess& excess);
  void rim(double excess_m);
  void tell(SkippedDot& skipped) const;

 private:
  bool is_better(int stage, double shortfall);

  int stage_ = -1;
  double shortfall_ = 0;
  SkipReason reason_ = SkipReason::kIncidence;
  LimitExcess excess_{};
  double length_m_ = 0;
  bool is_quill_ = false, is_rim_ = false;
};

}  // namespace hilbrush
