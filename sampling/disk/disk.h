#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "sampling/disk/components.h"
#include "sampling/model/edges.h"
#include "sampling/model/textured_mesh.h"

/// A component before it is mapped to the square: its triangles as faces that may be split, cut apart and
/// complemented. Every face records which part of which mesh triangle it is.
namespace hilbrush {

/// The part of a mesh triangle that a face covers; faces that only fill a hole have kNoTriangle.
struct FaceSource {
  std::uint32_t triangle = kNoTriangle;
  std::array<Eigen::Vector2d, 3> corners;  ///< second and third barycentric coordinate
};

class Disk {
 public:
  /// `triangles` in rising order, as in Component; sides to other triangles are boundary.
  Disk(const TexturedMesh& mesh, const Neighbors& neighbors, const std::vector<std::uint32_t>& triangles);

  const std::vector<Triangle>& faces() const { return faces_; }
  const std::vector<FaceSource>& sources() const { return sources_; }
  const Neighbors& neighbors() const { return neighbors_; }
  const std::vector<Eigen::Vector3d>& positions() const { return positions_; }  ///< per vertex, meters

  std::uint32_t from(TriangleSide s) const { return faces_[s.triangle][s.side]; }
  std::uint32_t to(TriangleSide s) const { return faces_[s.triangle][(s.side + 1) % 3]; }
  double length(TriangleSide s) const { return (positions_[to(s)] - positions_[from(s)]).norm(); }

  /// Angle of a face at one of its corners, radians.
  double angle(std::uint32_t face, std::size_t corner) const;

  /// Puts a vertex on an edge, at a share of side `s`, which then ends there. Returns the new vertex.
  std::uint32_t split_edge(TriangleSide s, double share = .5);
  /// Separates the two faces at an edge (call finish_cuts() after the last).
  void cut_edge(TriangleSide s);
  /// Gives each fan that the cuts have made a vertex of its own.
  void finish_cuts();
  /// Closes a boundary loop by a fan of faces without mass; the two sides of a loop of two are joined.
  void fill(const BoundaryLoop& loop);

 private:
  std::vector<Triangle> faces_;
  std::vector<FaceSource> sources_;
  Neighbors neighbors_;
  std::vector<Eigen::Vector3d> positions_;
};

}  // namespace hilbrush
