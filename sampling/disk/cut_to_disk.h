#pragma once
#include <cstddef>
#include <vector>

#include "sampling/base/result.h"
#include "sampling/disk/disk.h"

/// Makes a topological disk of a component: cuts it open along short paths.
namespace hilbrush {

struct CutDisk {
  Disk disk;
  /// The one boundary, counter-clockwise seen from outside; of a cut it begins where the cut begins.
  BoundaryLoop outer;
  bool is_cut = false;
  double cut_length_m = 0;
  /// Boundary vertices where cuts meet each other or a boundary, in order of `outer`: natural corners of the
  /// square.
  std::vector<std::uint32_t> forks;
};

/// The one loop of a disk, beginning at a vertex of it.
BoundaryLoop loop_from(const Disk& disk, std::uint32_t vertex);

struct CutOptions {
  double area_share = 1;  ///< of the component in the whole surface: how much it may be refined
  /// A component with more holes has all its boundaries but the longest filled: slits between them would make
  /// a maze.
  std::size_t max_holes = 32;
};

/// Coarse and blunt-angled triangulations are refined first, within bounds.
/// Genus 0 closed: cut along the shortest path between two far ends (an approximate geodesic diameter).
/// Handles and several boundaries: along the shortest arcs from boundary to boundary (or from one vertex back
/// to it) that leave a disk; a bag with a small mouth is slit. A hole that is filled instead makes the curve
/// jump across it. What is not a manifold, or as small as the last digits of its coordinates, cannot be cut.
/// Cost O(n log n).
Result<CutDisk> cut_to_disk(const TexturedMesh& mesh, const Neighbors& neighbors, const Component& component,
                            const CutOptions& options = {});

/// Cuts from the boundary to that one of the given vertices that is farthest from it: this slits a long
/// finger open, which the map would shrink to nothing. False, and nothing is changed, if all of them are on
/// the boundary or the cut leaves no disk.
bool extend_cut(CutDisk& cut, const std::vector<std::uint32_t>& vertices);

}  // namespace hilbrush
