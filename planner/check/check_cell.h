#pragma once
#include <Eigen/Geometry>
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "planner/cell_model/cell_description.h"
#include "sampling/model/textured_mesh.h"

/// The cell as the program check sees it: forward kinematics as a chain of transforms, the tool as a bundle
/// of rays, table parts by inside tests. Written apart from kinematics and clearance, which planning uses, so
/// that it does not repeat their faults. Thread-safe after construction.
namespace hilbrush {

class CheckCell {
 public:
  CheckCell(const TexturedMesh& mesh, const CellDescription& cell);
  ~CheckCell();

  /// The tool in O: origin at the flange, x along its yaw, z up.
  Eigen::Isometry3d X_OF(const Joints& joints) const;
  Eigen::Vector3d focus_O(const Eigen::Isometry3d& X_OF) const {
    return X_OF * (cell_.arm.flange_to_focus_m * beam_F_);
  }
  Eigen::Vector3d beam_O(const Eigen::Isometry3d& X_OF) const { return X_OF.linear() * beam_F_; }

  /// Why the beam, cast from the lens, does not land within `tolerance_m` of the focus; empty if it does.
  std::string beam_fault(const Eigen::Isometry3d& X_OF, double tolerance_m) const;
  /// What the lens body or the quill touches; empty if nothing.
  std::string body_fault(const Eigen::Isometry3d& X_OF) const;
  /// ... or upper arm, forearm or the robot's column.
  std::string body_fault(const Joints& joints) const;
  /// How far the ends of the lens travel in O between two poses.
  double travel_m(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) const;

 private:
  struct Rays;
  /// A solid cylinder in its frame: axis from `from_F` along `axis_F`.
  struct Cylinder {
    Eigen::Vector3d from_F, axis_F;
    double length_m, radius_m;
  };
  std::optional<double> lands_short_m(const Eigen::Vector3d& focus_O, const Eigen::Vector3d& beam_O,
                                      const Eigen::Vector3d& aside_O, double beyond_m) const;
  /// `body` in a frame B at X_OB.
  std::string body_fault(const Cylinder& body, const char* name, const Eigen::Isometry3d& X_OB) const;
  std::string link_fault(const CellDescription::Arm::Link& link, double length_m, const char* name,
                         const Eigen::Isometry3d& X_WB, const Eigen::Isometry3d& X_WF,
                         const Eigen::Isometry3d& X_OW) const;
  std::string column_fault(const Eigen::Isometry3d& X_WF, const Eigen::Isometry3d& X_W_fore,
                           const Eigen::Isometry3d& X_OW) const;
  bool touches_object(const Cylinder& body, const Eigen::Isometry3d& X_OB) const;
  bool touches_table(const Cylinder& body, const Eigen::Isometry3d& X_OB) const;
  bool is_any_blocked(const std::array<Eigen::Vector3d, 16>& from_O,
                      const std::array<Eigen::Vector3d, 16>& along_O, double length_m) const;
  Eigen::Isometry3d X_WF(const Joints& joints) const;
  Eigen::Isometry3d X_WO(const Joints& joints) const;
  bool is_in_table(const Eigen::Vector3d& p_O) const;

  CellDescription cell_;
  Eigen::Vector3d beam_F_;
  Cylinder lens_, quill_;
  double reach_m_;                            ///< radius of object, plate and post around O
  std::vector<Eigen::Vector3d> witnesses_O_;  ///< some vertices of the object
  std::unique_ptr<Rays> rays_;
};

}  // namespace hilbrush
