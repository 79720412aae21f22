#pragma once
#include <array>
#include <vector>

#include "sampling/model/edges.h"
#include "sampling/model/textured_mesh.h"

/// A mesh and what has to be known of its triangles to put dots on it.
namespace hilbrush {

/// What a dot takes from its triangle.
struct DotSurface {
  Eigen::Vector3f normal;                         ///< unit
  std::array<Eigen::Vector3f, 3> corner_normals;  ///< unit, over smooth edges
  Eigen::Vector3f least_barycentric;              ///< of a point that is a hair inside
};

struct Surface {
  /// Keeps a reference to `mesh`, which must outlive it. Cost O(n log n).
  explicit Surface(const TexturedMesh& mesh);

  const TexturedMesh& mesh;
  Neighbors neighbors;
  std::vector<DotSurface> dot_surfaces;  ///< of each triangle
};

}  // namespace hilbrush
