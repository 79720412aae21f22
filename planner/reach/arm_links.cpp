#include "planner/reach/arm_links.h"

#include <algorithm>
#include <cmath>

namespace hilbrush {
namespace {

/// After Ericson, Real-Time Collision Detection, 5.1.9.
double segment_distance_m(const Capsule& a, const Capsule& b) {
  const Eigen::Vector3d d1 = a.to - a.from;
  const Eigen::Vector3d d2 = b.to - b.from;
  const Eigen::Vector3d r = a.from - b.from;
  const double aa = d1.squaredNorm();
  const double bb = d2.squaredNorm();
  const double f = d2.dot(r);
  const double c = d1.dot(r);
  const double ab = d1.dot(d2);
  constexpr double kPointM2 = 1e-18;
  double s = 0;
  double t = 0;
  if (aa > kPointM2 && bb > kPointM2) {
    const double parallel = aa * bb - ab * ab;
    s = parallel > 1e-12 * aa * bb ? std::clamp((ab * f - c * bb) / parallel, 0., 1.) : 0;
    t = (ab * s + f) / bb;
    if (t < 0) {
      t = 0;
      s = std::clamp(-c / aa, 0., 1.);
    } else if (t > 1) {
      t = 1;
      s = std::clamp((ab - c) / aa, 0., 1.);
    }
  } else if (bb > kPointM2) {
    t = std::clamp(f / bb, 0., 1.);
  } else if (aa > kPointM2) {
    s = std::clamp(-c / aa, 0., 1.);
  }
  return (r + s * d1 - t * d2).norm();
}

Eigen::Vector3d flange_W(const CellDescription::Arm& arm, const Joints& joints) {
  const double forearm_angle = joints[kJ1] + joints[kJ2];
  return {arm.upper_arm_m * std::cos(joints[kJ1]) + arm.forearm_m * std::cos(forearm_angle),
          arm.upper_arm_m * std::sin(joints[kJ1]) + arm.forearm_m * std::sin(forearm_angle), joints[kJ3]};
}

}  // namespace

std::array<Capsule, 2> arm_links_W(const CellDescription::Arm& arm, const Joints& joints) {
  const double forearm_angle = joints[kJ1] + joints[kJ2];
  const Eigen::Vector2d elbow(arm.upper_arm_m * std::cos(joints[kJ1]),
                              arm.upper_arm_m * std::sin(joints[kJ1]));
  const Eigen::Vector2d wrist =
      elbow + arm.forearm_m * Eigen::Vector2d(std::cos(forearm_angle), std::sin(forearm_angle));
  const auto at = [](const Eigen::Vector2d& p, double height_m) {
    return Eigen::Vector3d(p.x(), p.y(), height_m);
  };
  const auto& [upper, fore] = std::pair{arm.upper_link, arm.fore_link};
  return {Capsule{{0, 0, upper.height_m}, at(elbow, upper.height_m), upper.radius_m},
          Capsule{at(elbow, fore.height_m), at(wrist, fore.height_m), fore.radius_m}};
}

Capsule lens_capsule_W(const CellDescription& cell, const Joints& joints) {
  const auto& arm = cell.arm;
  const double yaw = joints[kJ1] + joints[kJ2] + joints[kJ4];
  const double ce = std::cos(arm.beam_depression);
  const double se = std::sin(arm.beam_depression);
  const Eigen::Vector3d flange = flange_W(arm, joints);
  const Eigen::Vector3d beam_W(ce * std::cos(yaw), ce * std::sin(yaw), -se);
  const auto behind_focus = [&](double length_m) -> Eigen::Vector3d {
    return flange + (arm.flange_to_focus_m - length_m) * beam_W;
  };
  return {behind_focus(cell.lens.near_m), behind_focus(cell.lens.far_m), cell.lens.radius_m};
}

Capsule quill_capsule_W(const CellDescription::Arm& arm, const Joints& joints) {
  const Eigen::Vector3d flange = flange_W(arm, joints);
  return {flange, flange + Eigen::Vector3d(0, 0, arm.quill_length_m), arm.quill_radius_m};
}

Capsule column_capsule_W(const CellDescription::Arm& arm) {
  return {{0, 0, 0}, {0, 0, arm.column.height_m}, arm.column.radius_m};
}

double column_gap_m(const CellDescription::Arm& arm, const Capsule& body) {
  // A body above the top is at least that height away from it, whatever the rounded end of the column's
  // capsule.
  const double above_m = std::min(body.from.z(), body.to.z()) - body.radius_m - arm.column.height_m;
  return std::max(above_m, capsule_gap_m(column_capsule_W(arm), body));
}

double capsule_gap_m(const Capsule& a, const Capsule& b) {
  return segment_distance_m(a, b) - a.radius_m - b.radius_m;
}

}  // namespace hilbrush
