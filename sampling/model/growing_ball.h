#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "sampling/model/edges.h"
#include "sampling/model/textured_mesh.h"

/// What of a surface hangs together with a place within a ball around it.
namespace hilbrush {

/// The ball grows as far as it is asked to. Not thread-safe. Memory 16 bytes a triangle.
class GrowingBall {
 public:
  /// Keeps references.
  GrowingBall(const TexturedMesh& mesh, const Neighbors& neighbors);

  void begin(const Eigen::Vector3d& center_O, std::uint32_t triangle);
  /// The square of the least radius at which the ball holds a way along the surface from its center to the triangle:
  /// over the ways, the least of how far from the center the way crosses edges at most. Infinity if that is not less
  /// than `within2`. Cost O(k log k) over all calls, k triangles meet the ball.
  double entry2(std::uint32_t triangle, double within2);

 private:
  struct Crossing {
    double radius2;
    std::uint32_t triangle;
    bool operator>(const Crossing& other) const {
      return radius2 > other.radius2 || (radius2 == other.radius2 && triangle > other.triangle);
    }
  };
  struct Entered {
    double radius2 = 0;
    std::uint32_t round = 0;  ///< entered since the last begin() if it is this one
  };

  void enter(const Crossing& crossing);

  const TexturedMesh& mesh_;
  const Neighbors& neighbors_;
  Eigen::Vector3d center_O_ = Eigen::Vector3d::Zero();
  std::uint32_t round_ = 0;
  std::vector<Entered> entered_;    ///< a triangle
  std::vector<Crossing> frontier_;  ///< a heap, nearest first
};

}  // namespace hilbrush
