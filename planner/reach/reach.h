#pragma once
#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "planner/cell_model/plan_options.h"
#include "planner/reach/clearance.h"
#include "planner/reach/kinematics.h"
#include "planner/reach/skipped_dot.h"

/// Whether one dot can be exposed at all, and a pose of the cell that does it.
namespace hilbrush {

class FailureTally;

/// One way to expose a dot.
struct DotPose {
  TablePose table;
  double yaw = 0;
  Elbow elbow = Elbow::kPositive;
  Joints joints{};         ///< J4 and C unwrapped nearest to the reference
  double from_smooth = 0;  ///< rad, between the beam and the smooth normal
};

/// A dot as reach sees it.
struct Target {
  Eigen::Vector3d position_O, face_normal_O, smooth_normal_O;
};

/// A pose, or why there is none.
struct PoseSearchResult {
  std::optional<DotPose> pose;
  SkippedDot skipped;  ///< without a pose: reason, detail and amount; the dot's index is left to the caller
};

/// Clearance and reach on one object in one cell. Thread-safe after construction.
class Reach {
 public:
  Reach(const TexturedMesh& mesh, const CellDescription& cell, const PlanOptions& options);
  Reach(const Reach&) = delete;  // kinematics and clearance refer to the cell in here
  Reach& operator=(const Reach&) = delete;

  const CellDescription& cell() const { return cell_; }
  const PlanOptions& options() const { return options_; }
  const Kinematics& kinematics() const { return kinematics_; }
  const Clearance& clearance() const { return clearance_; }

  /// Whether some pose within the cone exposes the point.
  bool is_reachable(const Eigen::Vector3d& position_O, const Eigen::Vector3d& normal_O) const;

  /// Some pose within the cone around the face normal, as near to the smooth normal as a set of directions
  /// allows: first a coarse set, then a finer one with finer tilts. Depends on nothing but the target and,
  /// for windings, the reference.
  PoseSearchResult find_pose(const Target& target, const Joints& reference) const;

  /// The first, coarse search alone: fast also where there is nothing to find, and sometimes without success
  /// where the finer one finds a pose.
  std::optional<DotPose> find_pose_quickly(const Target& target, const Joints& reference) const;

  /// Whether the beam meets the target within the cone around its face normal, and beam and lens are clear.
  bool is_clear(const Target& target, const Eigen::Vector3d& beam_O) const;
  /// ... and some pose of table and arm brings it there.
  bool can_hit(const Target& target, const Eigen::Vector3d& beam_O) const;

  /// The joints that expose a dot on a table that is already chosen: within their limits, quill and links
  /// clear; the lens is not checked. `tally` (optional) is given the reason if there are none.
  std::optional<Joints> arm_joints(const TablePose& table, const Eigen::Vector3d& position_O, double yaw,
                                   Elbow elbow, const Joints& reference, FailureTally* tally = nullptr) const;

  const std::vector<double>& tilts() const { return tilts_; }
  /// The cone's limit against the face normal, a little inside the limit of the options.
  double cos_max_incidence() const { return cos_max_incidence_; }

 private:
  using Directions = std::vector<Eigen::Vector3d>;  ///< unit, around +z, nearest first
  std::optional<DotPose> search_cone(const Target& target, const Eigen::Vector3d& axis_O,
                                     const Directions& cone, const std::vector<double>& tilts,
                                     const Joints& reference, FailureTally* tally) const;
  /// The pose that brings this beam to the dot, if table, arm and quill allow one; the beam and the lens were
  /// found clear before.
  std::optional<DotPose> pose_for_beam(const Target& target, const Eigen::Vector3d& beam_O,
                                       const std::vector<double>& tilts, const Joints& reference,
                                       FailureTally* tally) const;

  CellDescription cell_;
  PlanOptions options_;
  Kinematics kinematics_;
  Clearance clearance_;
  double cos_max_incidence_;
  Directions cone_, fine_cone_, finest_cone_;
  std::vector<double> tilts_, fine_tilts_;
};

/// A yaw and the rotation that make the beam's direction in O `beam_O` at a given tilt.
struct TableSolution {
  double yaw, rotation;
};

/// None, or two that mirror each other.
class TableSolutions {
 public:
  TableSolutions() = default;
  explicit TableSolutions(const std::array<TableSolution, 2>& both) : solutions_(both), count_(2) {}

  const TableSolution* begin() const { return solutions_.data(); }
  const TableSolution* end() const { return solutions_.data() + count_; }
  bool empty() const { return count_ == 0; }
  std::size_t size() const { return count_; }
  const TableSolution& operator[](std::size_t i) const { return solutions_[i]; }

 private:
  std::array<TableSolution, 2> solutions_{};
  std::size_t count_ = 0;
};

TableSolutions solve_table(const Kinematics& kinematics, double tilt, const Eigen::Vector3d& beam_O);

}  // namespace hilbrush
