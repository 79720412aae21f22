#include "sim/film/beam.h"

#include <cmath>
#include <numbers>

namespace hilbrush {

namespace {

Eigen::Vector3d about_y(double angle, const Eigen::Vector3d& v) {
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  return {c * v.x() + s * v.z(), v.y(), c * v.z() - s * v.x()};
}

Eigen::Vector3d about_z(double angle, const Eigen::Vector3d& v) {
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  return {c * v.x() - s * v.y(), s * v.x() + c * v.y(), v.z()};
}

}  // namespace

Beam beam_from_joints(const CellDescription& cell, const Joints& joints) {
  const double forearm_angle = joints[kJ1] + joints[kJ2];
  const double yaw = forearm_angle + joints[kJ4];
  const double depression = cell.arm.beam_depression;
  const Eigen::Vector3d direction_W(std::cos(depression) * std::cos(yaw),
                                    std::cos(depression) * std::sin(yaw), -std::sin(depression));
  const Eigen::Vector3d flange_W(
      cell.arm.upper_arm_m * std::cos(joints[kJ1]) + cell.arm.forearm_m * std::cos(forearm_angle),
      cell.arm.upper_arm_m * std::sin(joints[kJ1]) + cell.arm.forearm_m * std::sin(forearm_angle),
      joints[kJ3]);
  const Eigen::Vector3d focus_W = flange_W + cell.arm.flange_to_focus_m * direction_W;

  // X_OW, the inverse of T(tilt axis) Ry(-A) T(0, 0, plate + post) Rz(C), factor by factor.
  const Eigen::Vector3d post_top(0, 0, cell.table.plate_height_m + cell.fixture.post_height_m);
  const auto into_table = [&](const Eigen::Vector3d& v) { return about_y(joints[kTilt], v); };
  const auto into_object = [&](const Eigen::Vector3d& v) { return about_z(-joints[kRotation], v); };
  return {into_object(into_table(focus_W - cell.table.tilt_axis_W) - post_top),
          into_object(into_table(direction_W))};
}

double beam_radius_m(double waist_m, double defocus_m) {
  constexpr double kWavelengthM = 450e-9, kBeamQuality = 10;
  const double rayleigh_m = std::numbers::pi * waist_m * waist_m / (kBeamQuality * kWavelengthM);
  return waist_m * std::hypot(1, defocus_m / rayleigh_m);
}

}  // namespace hilbrush
