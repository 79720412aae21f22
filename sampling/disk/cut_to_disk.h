#pragma once
#include <optional>
#include <string>

#include "sampling/disk/disk.h"

/// Makes a topological disk of a component: closed ones are cut open, holes are filled.
namespace hilbrush {

struct CutDisk {
  Disk disk;
  BoundaryLoop
      outer;  ///< the one boundary, counter-clockwise seen from outside; of a cut it begins where the cut begins
  bool is_cut = false;
  std::vector<std::uint32_t>
      forks;  ///< boundary vertices where cuts meet, in order of `outer`: natural corners of the square
};

/// Genus 0 closed: cut along the shortest path between two far ends (an approximate geodesic diameter; more branches
/// shear the map and lengthen the curve). Handles: all boundaries are filled, then short loops through one vertex are
/// cut. With boundaries: the longest loop is the outer one, the others are filled. Returns nothing, and a reason, for
/// what is not a manifold. Cost O(n log n).
std::optional<CutDisk> cut_to_disk(const TexturedMesh& mesh, const Neighbours& neighbours, const Component& component,
                                   std::string& reason);

}  // namespace hilbrush
