#include "sampling/tone/triangle_frame.h"

#include <algorithm>

namespace hilbrush {

using Eigen::Vector2d;
using Eigen::Vector3d;

TriangleFrame::TriangleFrame(const TexturedMesh& mesh, std::uint32_t triangle) : triangle_(triangle) {
  double longest = -1;
  for (int c = 0; c < 3; ++c) {
    const double squared =
        (mesh.corner(triangle, (c + 1) % 3) - mesh.corner(triangle, (c + 2) % 3)).squaredNorm();
    if (squared > longest) longest = squared, apex_ = c;
  }
  const Vector3d& origin = mesh.corner(triangle, (apex_ + 1) % 3);
  const Vector3d base = mesh.corner(triangle, (apex_ + 2) % 3) - origin;
  length_m_ = base.norm();
  if (!(length_m_ > 0)) return;
  height_m_ = 2 * mesh.area_vector(triangle).norm() / length_m_;
  foot_m_ = std::clamp(base.dot(mesh.corner(triangle, apex_) - origin) / length_m_, 0., length_m_);
}

std::array<Vector2d, 3> TriangleFrame::corners() const {
  std::array<Vector2d, 3> corners;
  corners[static_cast<std::size_t>(apex_)] = {foot_m_, height_m_};
  corners[static_cast<std::size_t>((apex_ + 1) % 3)] = {0, 0};
  corners[static_cast<std::size_t>((apex_ + 2) % 3)] = {length_m_, 0};
  return corners;
}

Vector2d TriangleFrame::place(const Vector3d& barycentric) const {
  return {barycentric[apex_] * foot_m_ + barycentric[(apex_ + 2) % 3] * length_m_,
          barycentric[apex_] * height_m_};
}

Vector3d TriangleFrame::barycentric(const Vector2d& place) const {
  const double up = place.y() / height_m_, along = (place.x() - up * foot_m_) / length_m_;
  Vector3d shares;
  shares[apex_] = up;
  shares[(apex_ + 1) % 3] = 1 - up - along;
  shares[(apex_ + 2) % 3] = along;
  return shares;
}

SurfacePoint TriangleFrame::point_inside(const Vector2d& place) const {
  Vector3d shares = barycentric(place).cwiseMax(0);
  shares /= shares.sum();
  return {triangle_, shares};
}

BoxedPolygon TriangleFrame::clip_box(const Vector2d& low, const Vector2d& high) const {
  BoxedPolygon polygon;
  for (const Vector2d& corner : corners()) polygon.b[polygon.count++] = corner;
  for (int side = 0; side < 4 && polygon.count > 0; ++side) {
    const int axis = side / 2;
    const double sign = side % 2 == 0 ? 1 : -1, at = side % 2 == 0 ? low[axis] : high[axis];
    BoxedPolygon kept;
    for (std::size_t i = 0; i < polygon.count; ++i) {
      const Vector2d &from = polygon.b[i], &to = polygon.b[(i + 1) % polygon.count];
      const double inside_from = sign * (from[axis] - at), inside_to = sign * (to[axis] - at);
      if (inside_from >= 0) kept.b[kept.count++] = from;
      if ((inside_from > 0 && inside_to < 0) || (inside_from < 0 && inside_to > 0))
        kept.b[kept.count++] = from + inside_from / (inside_from - inside_to) * (to - from);
    }
    polygon = kept;
  }
  if (polygon.count < 3) polygon.count = 0;
  for (std::size_t i = 0; i < polygon.count; ++i) {
    const Vector3d shares = barycentric(polygon.b[i]);
    polygon.b[i] = {shares[1], shares[2]};
  }
  return polygon;
}

}  // namespace hilbrush
