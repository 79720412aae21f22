#pragma once
#include <cstdint>
#include <vector>

#include "sampling/model/edges.h"
#include "sampling/model/textured_mesh.h"

/// The connected parts of a mesh, and their shape.
namespace hilbrush {

/// A boundary loop as the triangle sides along it, each beginning where the one before ends.
using BoundaryLoop = std::vector<TriangleSide>;

struct Component {
  std::vector<std::uint32_t> triangles;  ///< in rising order
  int genus = -1;                        ///< -1: not a manifold
  int boundary_loops = 0;
  double area_m2 = 0;
};

/// Triangles are connected over shared edges; the components are in order of their first triangles. Cost
/// O(n).
std::vector<Component> find_components(const TexturedMesh& mesh, const Neighbors& neighbors);

/// The shape of some connected triangles, in rising order; sides to other triangles are boundary.
Component describe_component(const TexturedMesh& mesh, const Neighbors& neighbors,
                             std::vector<std::uint32_t> triangles);

/// All loops of sides without a neighbor, in order of their first sides.
std::vector<BoundaryLoop> boundary_loops(const Neighbors& neighbors);

/// The fans of a mesh: all corners that are connected around a vertex have the same number, in order of their
/// first corners.
struct Fans {
  std::vector<Triangle> of_corners;  ///< numbers, by triangle and corner
  std::uint32_t count = 0;
};
Fans find_fans(const Neighbors& neighbors);

}  // namespace hilbrush
