#include "sampling/curve/dot_triangle.h"

namespace hilbrush {

DotTriangle::DotTriangle(const Surface& surface, const ToneField& tone, std::uint32_t triangle)
    : triangle_(triangle),
      corners_O_{surface.mesh.corner(triangle, 0), surface.mesh.corner(triangle, 1),
                 surface.mesh.corner(triangle, 2)},
      surface_(surface.dot_surfaces[triangle]),
      tone_(tone.on(triangle)) {}

Dot DotTriangle::dot_at(const Eigen::Vector3d& place, std::uint32_t component,
                        std::optional<double> asked) const {
  // See surface.cpp: a beam may miss the very edge of an open surface.
  const Eigen::Vector3d least = surface_.least_barycentric.cast<double>();
  Eigen::Vector3d b = place;
  if (b[0] < least[0] || b[1] < least[1] || b[2] < least[2]) {
    b = b.cwiseMax(least);
    b /= b.sum();
    asked.reset();
  }
  Dot dot;
  dot.position_O = b[0] * corners_O_[0] + b[1] * corners_O_[1] + b[2] * corners_O_[2];
  dot.normal_O = surface_.normal;
  const Eigen::Vector3f weights = b.cast<float>();
  const Eigen::Vector3f smooth = weights[0] * surface_.corner_normals[0] +
                                 weights[1] * surface_.corner_normals[1] +
                                 weights[2] * surface_.corner_normals[2];
  const float norm = smooth.norm();
  dot.smooth_normal_O = norm > 1e-3f ? Eigen::Vector3f(smooth / norm) : dot.normal_O;
  dot.triangle = triangle_;
  dot.component = component;
  dot.tone = static_cast<float>(asked && tone_.is_wanted_asked() ? *asked : tone_.wanted({b[1], b[2]}));
  return dot;
}

Dot make_dot(const Surface& surface, const ToneField& tone, const SurfacePoint& point,
             std::uint32_t component) {
  return DotTriangle(surface, tone, point.triangle).dot_at(point.barycentric, component);
}

}  // namespace hilbrush
