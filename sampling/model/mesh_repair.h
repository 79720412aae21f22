#pragma once
#include <string>
#include <vector>

#include "sampling/model/textured_mesh.h"

/// Turns a triangle soup into a mesh that can be cut and mapped: welds positions that are equal but for
/// rounding, drops degenerate and duplicate triangles, orients neighbors consistently (closed and almost
/// closed components outwards, open ones as most of their triangles are), splits what is not manifold.
/// Afterwards every edge has one or two triangles and every vertex one fan. Every repair is counted. Large
/// meshes are renumbered, see renumber.h.
namespace hilbrush {

struct Repair {
  std::string what;  ///< "vertices welded", "degenerate triangles dropped", ...
  std::size_t count = 0;
};

struct RepairedMesh {
  TexturedMesh mesh;
  std::vector<Repair> repairs;  ///< only those that happened
};

/// Takes the mesh by value: hand it over with std::move to spare a copy of its textures.
/// @throws InputError if nothing with area is left. Cost O(n log n).
RepairedMesh repair_mesh(TexturedMesh mesh);

}  // namespace hilbrush
