#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "sampling/model/edges.h"
#include "sampling/model/textured_mesh.h"

/// Which part of a surface is connected to a point of it within a ball around the point.
namespace hilbrush {

/// The ball grows only as far as entry2() needs it. Not thread-safe. Memory 16 bytes a triangle.
class GrowingBall {
 public:
  /// Keeps references to both.
  GrowingBall(const TexturedMesh& mesh, const Neighbors& neighbors);

  void begin(const Eigen::Vector3d& center_O, std::uint32_t triangle);
  /// The square of the smallest radius at which the ball contains a path along the surface from its center to
  /// the triangle: the minimum, over all paths, of the greatest distance from the center at which the path
  /// crosses an edge. Infinity if that is not less than `within2`. Cost O(k log k) over all calls, where k
  /// triangles meet the ball.
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
    std::uint32_t round = 0;  ///< the ball, counted by begin(), that entered the triangle last
  };

  void enter(const Crossing& crossing);

  const TexturedMesh& mesh_;
  const Neighbors& neighbors_;
  Eigen::Vector3d center_O_ = Eigen::Vector3d::Zero();
  std::uint32_t round_ = 0;
  std::vector<Entered> entered_;    ///< by triangle
  std::vector<Crossing> frontier_;  ///< a heap, nearest first
};

}  // namespace hilbrush
