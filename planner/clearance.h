#pragma once
#include <cstdint>

#include "planner/kinematics.h"
#include "planner/object_distance.h"
#include "planner/object_rays.h"

/// Whether the tool - beam, lens body, quill - is clear of object, post and plate, which to it are one rigid body.
/// Thread-safe after construction.
namespace hilbrush {

enum class Obstruction : std::uint8_t { kNone, kBeamObject, kBeamTable, kLensObject, kLensTable };

class Clearance {
 public:
  Clearance(const TexturedMesh& mesh, const CellDescription& cell);

  /// What planning keeps between the tool and anything else, where it stands still. Half of it is for small moves, see
  /// transit.h.
  static constexpr double kMarginM = 1e-3;

  /// What blocks the beam between the lens and the focus, or nothing.
  Obstruction beam_obstruction(const Eigen::Vector3d& focus_O, const Eigen::Vector3d& beam_O) const;
  /// How far from the focus the object blocks the beam; the lens's far end if it does not.
  double beam_free_length_m(const Eigen::Vector3d& focus_O, const Eigen::Vector3d& beam_O) const;

  /// Whether lens and quill keep kMarginM; the first obstruction found, or nothing.
  Obstruction body_obstruction(const ToolPose& tool) const;
  /// The lens alone: it depends on nothing but the dot and the beam's direction in O.
  Obstruction lens_obstruction(const Eigen::Vector3d& focus_O, const Eigen::Vector3d& beam_O) const;
  Obstruction quill_obstruction(const ToolPose& tool) const;

  /// A lower bound on the distance between the tool's bodies and everything else; negative: maybe they touch. At most
  /// about 25 mm.
  double slack_m(const ToolPose& tool) const;

 private:
  struct Slack {
    double object_m, table_m;
    double least_m() const { return std::min(object_m, table_m); }
  };
  /// Of balls of `radius_m` at `first_m`, `first_m + step_m`, ... along a line.
  void row_of_balls(const Eigen::Vector3d& from_O, const Eigen::Vector3d& direction_O, double first_m, double step_m,
                    int count, double radius_m, Slack& slack) const;
  void cover_cylinder(const Eigen::Vector3d& from_O, const Eigen::Vector3d& direction_O, double length_m,
                      double radius_m, double half_step_m, Slack& slack) const;
  Slack lens_slack(const Eigen::Vector3d& focus_O, const Eigen::Vector3d& beam_O) const;
  Slack lens_slack_fine(const Eigen::Vector3d& focus_O, const Eigen::Vector3d& beam_O) const;
  Slack quill_slack(const ToolPose& tool) const;
  /// To the plate and the post, in O; exact outside, not above zero inside.
  double table_distance_m(const Eigen::Vector3d& p_O) const;

  const CellDescription& cell_;
  ObjectRays rays_;
  ObjectDistance distance_;
};

}  // namespace hilbrush
