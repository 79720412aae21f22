#pragma once
#include <cstddef>

#include "sampling/disk/disk.h"

/// Adds vertices where a map needs them.
namespace hilbrush {

/// Halves the longest edges until there are `face_count` faces: a box of twelve triangles has too few
/// vertices for a smooth map. Cost O(faces log faces).
void refine(Disk& disk, std::size_t face_count);

/// Splits edges whose opposite angles sum to more than 180 degrees, those first that shear a map most, at the
/// foot of the blunter angle's height, until the triangulation is Delaunay or has `max_faces` faces: cotan
/// weights are negative on such edges, and clamping them shears the map. After Dyer, Zhang and Moeller,
/// "Delaunay mesh construction", 2007; differs: bounded, no flips, since every face must stay in its
/// triangle. Cost O(faces log faces).
void split_towards_delaunay(Disk& disk, std::size_t max_faces);

}  // namespace hilbrush
