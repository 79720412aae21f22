#pragma once
#include <algorithm>
#include <cmath>
#include <numbers>

#include "planner/cell_model/cell_description.h"
#include "planner/reach/kinematics.h"
#include "planner/reach/object_rays.h"

/// The reference for clearance: bodies as dense bundles of rays against the object, and as dense points
/// against post and plate. Slow and without any margin.
namespace hilbrush {

class RayBundle {
 public:
  RayBundle(const TexturedMesh& mesh, const CellDescription& cell) : cell_(cell), rays_(mesh) {}

  bool lens_touches(const Eigen::Vector3d& focus_O, const Eigen::Vector3d& beam_O, double wider_m = 0) const {
    const auto& lens = cell_.lens;
    return touches(focus_O - (lens.near_m - wider_m) * beam_O, -beam_O,
                   lens.far_m - lens.near_m + 2 * wider_m, lens.radius_m + wider_m);
  }
  bool quill_touches(const ToolPose& tool, double wider_m = 0) const {
    return touches(tool.focus_O - cell_.arm.flange_to_focus_m * tool.beam_O, tool.up_O,
                   cell_.arm.quill_length_m, cell_.arm.quill_radius_m + wider_m);
  }
  /// A solid cylinder.
  bool touches(const Eigen::Vector3d& from_O, const Eigen::Vector3d& axis_O, double length_m,
               double radius_m) const {
    const Eigen::Vector3d u = axis_O.unitOrthogonal(), v = axis_O.cross(u);
    const auto around = [&](int i, int count) -> Eigen::Vector3d {
      const double angle = 2 * std::numbers::pi * i / count;
      return std::cos(angle) * u + std::sin(angle) * v;
    };
    const auto is_solid = [&](const Eigen::Vector3d& start_O) {
      if (rays_.is_blocked(start_O, axis_O, 0, length_m)) return true;
      for (int k = 0; k <= kSlices; ++k)
        if (is_in_table(start_O + (length_m * k / kSlices) * axis_O)) return true;
      return false;
    };
    if (is_solid(from_O)) return true;
    for (int ring = 1; ring <= kRings; ++ring)
      for (int i = 0; i < 6 * ring; ++i)
        if (is_solid(from_O + (radius_m * ring / kRings) * around(i, 6 * ring))) return true;
    for (int k = 0; k <= kSlices; ++k)  // diameters, for what comes in from the side
      for (int i = 0; i < 2 * kDiameters; i += 2) {
        const Eigen::Vector3d side_O = around(i, 4 * kDiameters);
        if (rays_.is_blocked(from_O + (length_m * k / kSlices) * axis_O - radius_m * side_O, side_O, 0,
                             2 * radius_m))
          return true;
      }
    return false;
  }

 private:
  static constexpr int kRings = 4, kSlices = 24, kDiameters = 6;

  bool is_in_table(const Eigen::Vector3d& p_O) const {
    const double r = p_O.head<2>().norm(), post = cell_.fixture.post_height_m;
    if (p_O.z() > 0 || p_O.z() < -post - cell_.table.plate_thickness_m) return false;
    return r < (p_O.z() > -post ? cell_.fixture.post_radius_m : cell_.table.plate_radius_m);
  }

  const CellDescription& cell_;
  ObjectRays rays_;
};

}  // namespace hilbrush
