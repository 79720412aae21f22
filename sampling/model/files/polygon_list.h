#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "sampling/model/files/face_list.h"

namespace hilbrush {

/// Polygons as PLY and OFF have them: colors and texture coordinates belong to points or to faces, and any
/// index may name a point that does not exist. What is empty was not given.
struct PolygonList {
  static constexpr std::uint32_t kNoPoint = std::numeric_limits<std::uint32_t>::max();

  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> point_uv;
  std::vector<float> point_luminance;  ///< linear
  std::vector<std::uint32_t> corners;
  std::vector<std::size_t> face_ends;      ///< of each face: one past its last corner
  std::vector<Eigen::Vector2d> corner_uv;  ///< goes before point_uv; may end early: the rest is zero
  std::vector<float> face_luminance;  ///< point_luminance goes before it; may end early: the rest is white

  /// @throws InputError at `at` if the limits allow no further face with this many corners.
  void check_room(std::size_t corner_count, const std::string& at, const ModelLimits& limits) const;

  /// The faces whose points all exist; `dropped` counts the others. Leaves nothing usable behind.
  FaceList take_faces(const std::string& at, std::size_t& dropped);
};

}  // namespace hilbrush
