#pragma once
#include <Eigen/Core>
#include <array>
#include <memory>

#include "sampling/model/textured_mesh.h"

/// Rays against the object, by Embree. Thread-safe after construction.
namespace hilbrush {

class ObjectRays {
 public:
  explicit ObjectRays(const TexturedMesh& mesh);
  ~ObjectRays();
  ObjectRays(ObjectRays&&) noexcept;

  /// Distance from `from_O` along `direction_O` (unit) to the first surface between `near_m` and `far_m`;
  /// `far_m` if there is none.
  double free_length_m(const Eigen::Vector3d& from_O, const Eigen::Vector3d& direction_O, double near_m,
                       double far_m) const;
  /// Whether any surface lies between; faster than the length.
  bool is_blocked(const Eigen::Vector3d& from_O, const Eigen::Vector3d& direction_O, double near_m,
                  double far_m) const;
  /// The same of a ray from `from_O` and of three beside it, which begin at `side_near_m`; one packet of
  /// four.
  bool is_beam_blocked(const Eigen::Vector3d& from_O, const Eigen::Vector3d& direction_O,
                       const std::array<Eigen::Vector3d, 3>& aside_O, double near_m, double side_near_m,
                       double far_m) const;

 private:
  struct Scene;
  std::unique_ptr<Scene> scene_;
};

}  // namespace hilbrush
