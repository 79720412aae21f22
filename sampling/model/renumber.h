#pragma once
#include "sampling/model/textured_mesh.h"

/// Numbers that follow the surface. Whatever walks along a surface, as everything here does, then finds in the cache
/// what it needs next; files list triangles in any order.
namespace hilbrush {

/// Parts that hang together by vertices keep their order; in each, triangles are put in that of a Morton curve through
/// the bounds of all (Morton 1966), and vertices in that in which triangles use them. A mesh that lies in the cache
/// anyway stays as it is. The surface is the same, to the bit; a triangle keeps its first corner. O(n log n), about .2
/// microseconds a triangle.
/// @pre every vertex is used by a triangle
void renumber_along_surface(TexturedMesh& mesh);

}  // namespace hilbrush
