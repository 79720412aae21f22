#pragma once
#include <array>
#include <cstdint>
#include <span>

#include "sampling/model/textured_mesh.h"

/// A triangle in its own plane: x runs along its longest edge, y from there to the apex; meters.
namespace hilbrush {

/// What a box cuts out of a triangle, by second and third barycentric coordinates; no corners if they don't
/// meet.
struct BoxedPolygon {
  std::array<Eigen::Vector2d, 8> b;  ///< a triangle cut by four sides has seven corners
  std::size_t count = 0;

  std::span<const Eigen::Vector2d> corners() const { return {b.data(), count}; }
};

class TriangleFrame {
 public:
  TriangleFrame(const TexturedMesh& mesh, std::uint32_t triangle);

  double length_m() const { return length_m_; }
  double height_m() const { return height_m_; }  ///< 0: a degenerate triangle, which has no inside
  /// Of the three corners, in the mesh's order.
  std::array<Eigen::Vector2d, 3> corners() const;

  Eigen::Vector2d place(const Eigen::Vector3d& barycentric) const;
  /// Negative shares outside the triangle. Needs a height.
  Eigen::Vector3d barycentric(const Eigen::Vector2d& place) const;
  /// The point of the triangle under `place`, moved inside if it is outside.
  SurfacePoint point_inside(const Eigen::Vector2d& place) const;

  BoxedPolygon clip_box(const Eigen::Vector2d& low, const Eigen::Vector2d& high) const;

 private:
  std::uint32_t triangle_;
  int apex_ = 0;                                     ///< the corner opposite to the longest edge
  double length_m_ = 0, height_m_ = 0, foot_m_ = 0;  ///< foot of the apex along the longest edge
};

}  // namespace hilbrush
