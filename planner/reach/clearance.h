#pragma once
#include <array>
#include <cstdint>

#include "planner/reach/arm_links.h"
#include "planner/reach/kinematics.h"
#include "planner/reach/object_distance.h"
#include "planner/reach/object_rays.h"

/// Whether the beam, the lens body, the quill, the arm's links and the robot's column are clear of object,
/// post and plate, which move as one rigid body, and of each other. Beams are rays (Embree); bodies are rows
/// of balls looked up in a distance field, which is as fast and was tested against bundles of rays
/// (tests/planner/reach/clearance_test.cpp). Thread-safe after construction.
namespace hilbrush {

enum class Obstruction : std::uint8_t {
  kNone,
  kBeamObject,
  kBeamTable,
  kLensObject,
  kLensTable,
  kQuillObject,
  kQuillTable,
  kLinkObject,
  kLinkTable,
  kLinkLens,
  kColumnObject,
  kColumnTable,
  kColumnTool
};

/// Which parts are too near to each other, and by how much.
struct Shortfall {
  Obstruction what = Obstruction::kNone;
  double amount_m = 0;  ///< missing to the margin
};

class Clearance {
 public:
  Clearance(const TexturedMesh& mesh, const CellDescription& cell);

  /// The distance that planning keeps between the tool and anything else at rest. Half of it is reserved for
  /// small moves, see transit.h.
  static constexpr double kMarginM = 1e-3;

  /// What blocks the beam between the lens and the focus, or nothing.
  Obstruction beam_obstruction(const Eigen::Vector3d& focus_O, const Eigen::Vector3d& beam_O) const;
  /// How far from the focus something blocks the beam; the lens's far end if it does not.
  double beam_free_length_m(const Eigen::Vector3d& focus_O, const Eigen::Vector3d& beam_O) const;

  /// Whether lens and quill keep kMarginM; the first obstruction found, or nothing.
  Obstruction body_obstruction(const ToolPose& tool) const;
  /// The lens alone: it depends on nothing but the dot and the beam's direction in O.
  Obstruction lens_obstruction(const Eigen::Vector3d& focus_O, const Eigen::Vector3d& beam_O) const;
  Obstruction quill_obstruction(const ToolPose& tool) const;
  /// Upper arm and forearm, against object, table and the lens; the column, against those, the quill and the
  /// forearm. Nothing is computed in a cell where they cannot meet.
  Obstruction links_obstruction(const TablePose& table, const Joints& joints) const;

  /// The same with the amount, for the reason of dots that are skipped.
  Shortfall lens_shortfall(const Eigen::Vector3d& focus_O, const Eigen::Vector3d& beam_O) const;
  Shortfall quill_shortfall(const ToolPose& tool) const;
  Shortfall links_shortfall(const TablePose& table, const Joints& joints) const;

  /// A lower bound on the distance between lens and quill and everything else; if negative, they may touch.
  /// At most kSlackMaxM.
  double slack_m(const ToolPose& tool) const;
  /// ... and of the links, too.
  double slack_m(const Kinematics& kinematics, const Joints& joints) const;
  static constexpr double kSlackMaxM = 25e-3;

  /// Radius of object, post and plate around the tilt axis, and around C.
  double radius_around_tilt_m() const { return radius_around_tilt_m_; }
  double radius_around_rotation_m() const { return radius_around_rotation_m_; }

 private:
  struct Slack {
    double object_m = kSlackMaxM, table_m = kSlackMaxM;
    double least_m() const { return std::min(object_m, table_m); }
    Shortfall shortfall(Obstruction by_object, Obstruction by_table) const;
  };
  /// Balls on a cylinder's axis, each covering a slice of it; they bulge over its two ends.
  struct BallRow {
    Eigen::Vector3d first_O, step_O;
    int count;
    double ball_m, slice_m, cylinder_m;  ///< radius of a ball, length of a slice, radius of the cylinder
  };
  static BallRow cover(const Eigen::Vector3d& from_O, const Eigen::Vector3d& along_O, double length_m,
                       double radius_m, double half_step_m);
  BallRow lens_row(const Eigen::Vector3d& focus_O, const Eigen::Vector3d& beam_O, double half_step_m,
                   double from_m) const;
  BallRow quill_row(const ToolPose& tool) const;
  /// Whether a whole row keeps this margin to the ball around everything: then no look-up is needed.
  bool is_far(const BallRow& row, double margin_m) const;
  /// Whether a whole row keeps the margin; slices inside a free ball are skipped.
  bool keeps_margin(const BallRow& row) const;
  void reduce_clearance(const BallRow& row, Slack& slack) const;
  void reduce_clearance(const Eigen::Vector3d& ball_O, double radius_m, Slack& slack) const;
  Slack lens_slack(const Eigen::Vector3d& focus_O, const Eigen::Vector3d& beam_O) const;
  Slack lens_slack_fine(const Eigen::Vector3d& focus_O, const Eigen::Vector3d& beam_O) const;
  Slack quill_slack(const ToolPose& tool) const;
  Slack links_slack(const TablePose& table, const Joints& joints) const;
  double link_lens_gap_m(const Joints& joints) const;
  Slack column_slack(const TablePose& table) const;
  double column_tool_gap_m(const Joints& joints) const;
  void reduce_clearance(const Capsule& capsule_O, Slack& slack) const;
  /// Whether links_obstruction() has anything to check.
  bool arm_may_touch() const {
    return links_may_touch_ || links_may_touch_lens_ || cell_.arm.column.radius_m > 0;
  }
  double table_free_length_m(const Eigen::Vector3d& focus_O, const Eigen::Vector3d& beam_O) const;
  /// To the plate and the post, in O; exact outside up to the field's range and never more than it is, not
  /// above zero inside.
  double table_distance_m(const Eigen::Vector3d& p_O) const;

  const CellDescription& cell_;
  double radius_around_tilt_m_, radius_around_rotation_m_;
  bool links_may_touch_ = false, links_may_touch_lens_ = false;
  bool column_may_touch_ = false;  ///< ... the object or the table
  double tool_radius_m_;           ///< horizontally, of all that goes with the flange, around its axis
  /// The ball around object, post and plate; its center is on the axis of C.
  double ball_height_m_, ball_radius_m_;
  ObjectRays rays_;
  ObjectDistance distance_;
};

}  // namespace hilbrush
