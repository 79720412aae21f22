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
  std::vector<std::uint32_t> triangles;  ///< rising
  int genus = -1;                        ///< -1: not a manifold
  int boundary_loops = 0;
  double area_m2 = 0;
};

/// Triangles hang together over shared edges; the components are in order of their first triangles. Cost O(n).
std::vector<Component> find_components(const TexturedMesh& mesh, const Neighbors& neighbors);

/// The shape of some triangles, rising, that hang together by themselves: sides to other triangles are boundary.
Component describe_component(const TexturedMesh& mesh, const Neighbors& neighbors,
                             std::vector<std::uint32_t> triangles);

/// All loops of sides without a neighbor, in order of their first sides.
std::vector<BoundaryLoop> boundary_loops(const Neighbors& neighbors);

/// Numbers the fans of a mesh: all corners that hang together around a vertex get the same number, in order of their
/// first corners. Returns the numbers by triangle and how many there are.
struct Fans {
  std::vector<Triangle> of_corners;
  std::uint32_t count = 0;
};
Fans find_fans(const Neighbors& neighbors);

}  // namespace hilbrush
