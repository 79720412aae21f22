#pragma once
#include <string>
#include <vector>

#include "sampling/textured_mesh.h"

/// What a triangle soup needs before it can be cut and mapped: weld equal positions, drop degenerate and duplicate triangles,
/// orient neighbours alike (closed components outwards), split what is not manifold. Every repair is counted.
namespace hilbrush {

struct Repair {
  std::string what;       ///< "vertices welded", "degenerate triangles dropped", ...
  std::size_t count = 0;
};

struct RepairedMesh {
  TexturedMesh mesh;
  std::vector<Repair> repairs;  ///< only those that happened
};

/// @throws InputError if nothing with area is left. Cost O(n log n).
RepairedMesh repair_mesh(const TexturedMesh& mesh);

}  // namespace hilbrush
