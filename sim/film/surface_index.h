#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "sampling/model/textured_mesh.h"

namespace hilbrush {

/// Finds triangles: along a ray and around a place. Embree behind it. Thread-safe after construction.
class SurfaceIndex {
 public:
  struct RayHit {
    SurfacePoint point;
    double distance_m = 0;
  };

  /// Keeps a reference to `mesh`, which must outlive it.
  explicit SurfaceIndex(const TexturedMesh& mesh);
  ~SurfaceIndex();
  SurfaceIndex(SurfaceIndex&&) noexcept;

  /// The first triangle along the ray, from either side. Embree finds it in single precision; the place on it
  /// is computed in double.
  std::optional<RayHit> cast(const Eigen::Vector3d& origin_O, const Eigen::Vector3d& direction_O) const;
  /// Replaces `triangles` by those whose bounding box comes within radius_m of the center (a superset of the
  /// triangles that do), rising.
  void triangles_near(const Eigen::Vector3d& center_O, double radius_m,
                      std::vector<std::uint32_t>& triangles) const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace hilbrush
