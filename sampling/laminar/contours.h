#pragma once
#include <cstdint>
#include <vector>

#include "sampling/model/textured_mesh.h"

/// The intersections of a mesh with horizontal planes.
namespace hilbrush {

/// A straight piece of a contour, within one triangle.
struct ContourPiece {
  std::uint32_t triangle = 0;
  Eigen::Vector3d from_b, to_b;  ///< barycentric
  Eigen::Vector3d from_O, to_O;
  std::uint64_t from_edge = 0, to_edge = 0;  ///< the mesh edges on which it begins and ends

  void reverse();
  double length() const { return (to_O - from_O).norm(); }
};

/// A chain of pieces: each begins on the edge on which the one before ends.
struct Contour {
  std::vector<ContourPiece> pieces;
  bool is_closed = false;
};

/// Which triangles meet which of the planes z = lowest + (k + .5) * distance. Triangles in a plane meet none;
/// a vertex on a plane counts as above it, so that contours of a closed surface are closed.
class Slices {
 public:
  /// Keeps a reference to `mesh`. Cost O(triangles + pieces), 4 bytes a piece.
  Slices(const TexturedMesh& mesh, double distance_m);

  std::size_t count() const { return first_.size() - 1; }
  std::size_t piece_count() const { return triangles_.size(); }

  /// The pieces of a slice, in order of their triangles.
  std::vector<ContourPiece> pieces(std::size_t slice) const;

 private:
  double height(std::size_t slice) const { return lowest_ + (static_cast<double>(slice) + .5) * distance_; }
  std::int64_t slice_at_or_above(double z) const;

  const TexturedMesh& mesh_;
  double distance_, lowest_ = 0;
  std::vector<std::size_t> first_;  ///< per slice, into triangles_
  std::vector<std::uint32_t> triangles_;
};

/// Joins the pieces of one slice: open contours first, then closed ones, each in order of its first piece.
/// Where more than two pieces meet on an edge (a surface that is not a manifold) contours end. Cost O(n log
/// n).
std::vector<Contour> join(std::vector<ContourPiece> pieces);

}  // namespace hilbrush
