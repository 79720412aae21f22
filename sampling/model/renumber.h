#pragma once
#include "sampling/model/textured_mesh.h"

/// Numbers triangles and vertices along the surface. Files list them in any order, but all later stages walk
/// along the surface: neighbors with near numbers are in the cache when they are needed.
namespace hilbrush {

/// Parts that are connected by vertices keep their order. In each, triangles get the order of a Morton curve
/// through the bounds of all (Morton 1966), and vertices the order in which triangles use them. A mesh that
/// fits in the cache stays as it is. The surface is the same, to the bit; a triangle keeps its first corner.
/// O(n log n), about .2 microseconds a triangle.
/// @pre every vertex is used by a triangle
void renumber_along_surface(TexturedMesh& mesh);

}  // namespace hilbrush
