#pragma once
#include <array>
#include <vector>

#include "sampling/model/edges.h"
#include "sampling/model/textured_mesh.h"

namespace hilbrush {

/// Unit normals per corner: the mean, weighted by angle, over the triangles around the vertex up to the next
/// sharp edge.
std::vector<std::array<Eigen::Vector3f, 3>> smooth_corner_normals(const TexturedMesh& mesh,
                                                                  const Neighbors& neighbors);

}  // namespace hilbrush
