#pragma once
#include <optional>
#include <string>

#include "sampling/disk/disk.h"

/// Makes a topological disk of a component: cut open along short paths.
namespace hilbrush {

struct CutDisk {
  Disk disk;
  /// The one boundary, counter-clockwise seen from outside; of a cut it begins where the cut begins.
  BoundaryLoop outer;
  bool is_cut = false;
  double cut_length_m = 0;
  /// Boundary vertices where cuts meet each other or a boundary, in order of `outer`: natural corners of the square.
  std::vector<std::uint32_t> forks;
};

/// The one loop of a disk, beginning at a vertex of it.
BoundaryLoop loop_from(const Disk& disk, std::uint32_t vertex);

struct CutOptions {
  double area_share = 1;        ///< of the whole surface: what a component is worth refining for
  std::size_t most_holes = 32;  ///< of more boundaries all but the longest are filled: slits between them make a maze
};

/// Coarse and blunt-angled triangulations are refined first, within bounds.
/// Genus 0 closed: cut along the shortest path between two far ends (an approximate geodesic diameter). Handles and
/// several boundaries: along the shortest arcs from boundary to boundary (or from one vertex back to it) that leave a
/// disk; a bag with a small mouth is slit. A hole that is filled instead makes the curve jump across it. Returns
/// nothing, and a reason, for what is not a manifold. Cost O(n log n).
std::optional<CutDisk> cut_to_disk(const TexturedMesh& mesh, const Neighbors& neighbors, const Component& component,
                                   std::string& reason, const CutOptions& options = {});

/// Cuts from the boundary to that one of the given vertices that lies deepest inside: a long finger, which the map
/// would shrink to nothing, is slit open. False if all of them are on the boundary.
bool extend_cut(CutDisk& cut, const std::vector<std::uint32_t>& vertices);

}  // namespace hilbrush
