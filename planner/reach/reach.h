#pragma once
#include <optional>
#include <vector>

#include "planner/plan.h"
#include "planner/reach/clearance.h"

/// Inside planner/: what Reach knows, and the search for any pose at all that exposes one dot.
namespace hilbrush {

/// One way to expose a dot.
struct DotPose {
  TablePose table;
  double yaw = 0;
  Elbow elbow = Elbow::kPositive;
  Joints joints{};         ///< J4 and C unwrapped nearest to the reference
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
  /// Some pose within the cone around the face normal, as near to the smooth normal as a set of directions allows:
  /// first a coarse one, then a finer one with finer tilts. Depends on nothing but the target (and, for windings, the
  /// reference). If there is none, `skipped` (optional) gets reason, detail and amount.
  std::optional<DotPose> find_pose(const Target& target, const Joints& reference, SkippedDot* skipped = nullptr) const;

  /// The first, coarse look alone: fast also where there is nothing to find, and sometimes blind there.
  std::optional<DotPose> find_pose_quickly(const Target& target, const Joints& reference) const;

  /// Whether the beam meets the target within the cone around its face normal, and beam and lens pass everything.
  bool is_clear(const Target& target, const Eigen::Vector3d& beam_O) const;
  /// ... and some pose of table and arm brings it there.
  bool can_hit(const Target& target, const Eigen::Vector3d& beam_O) const;

  /// The arm's part of it, on a table that is already chosen. Limits, quill and links are looked at, not the lens.
  bool arm_fits(const TablePose& table, const Eigen::Vector3d& position_O, double yaw, Elbow elbow,
                const Joints& reference, Joints& joints, class FailureTally* tally) const;

  const std::vector<double>& tilts() const { return tilts_; }
  /// The cone's limit against the face normal, a hair inside what was asked for.
  double cos_max_incidence() const { return cos_max_incidence_; }

 private:
  using Directions = std::vector<Eigen::Vector3d>;  ///< unit, around +z, nearest first
  std::optional<DotPose> search_cone(const Target& target, const Eigen::Vector3d& axis_O, const Directions& cone,
                                     const std::vector<double>& tilts, const Joints& reference,
                                     FailureTally* tally) const;
  /// The pose that brings this beam to the dot, if table, arm and quill agree; the beam and the lens were found clear
  /// before.
  std::optional<DotPose> pose_for_beam(const Target& target, const Eigen::Vector3d& beam_O,
                                       const std::vector<double>& tilts, const Joints& reference,
                                       FailureTally* tally) const;

  double cos_max_incidence_;
  Directions cone_, fine_cone_, finest_cone_;
  std::vector<double> tilts_, fine_tilts_;
};

/// Yaws (two, mirror images) and the rotation that make the beam's direction in O `beam_O` at this tilt.
struct TableSolution {
  double yaw, rotation;
};
int solve_table(const Kinematics& kinematics, double tilt, const Eigen::Vector3d& beam_O, TableSolution* solutions);

}  // namespace hilbrush
