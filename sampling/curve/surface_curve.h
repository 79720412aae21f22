#pragma once
#include <array>
#include <vector>

#include "sampling/curve/chart.h"
#include "sampling/curve/stream_dots.h"
#include "sampling/model/edges.h"

/// What SurfaceCurve keeps of a mesh: charts with their base trees, and what a dot needs to know of its surroundings.
namespace hilbrush {

/// What a dot takes from its triangle.
struct DotSurface {
  Eigen::Vector3f normal;                         ///< unit
  std::array<Eigen::Vector3f, 3> corner_normals;  ///< unit, over smooth edges
  Eigen::Vector3f least_barycentric;              ///< of a point that is a hair inside
};

struct SurfaceCurve::Implementation {
  explicit Implementation(const TexturedMesh& m) : mesh(m) {}

  const TexturedMesh& mesh;
  Neighbors neighbors;
  std::vector<ComponentReport> components;
  std::vector<Chart> charts;  ///< in the order in which they are walked
  std::vector<DotSurface> dot_surfaces;
};

std::vector<DotSurface> find_dot_surfaces(const TexturedMesh& mesh, const Neighbors& neighbors);

/// Unit normals per corner: the mean, weighted by angle, over the triangles around the vertex up to the next sharp
/// edge.
std::vector<std::array<Eigen::Vector3f, 3>> smooth_corner_normals(const TexturedMesh& mesh, const Neighbors& neighbors);

}  // namespace hilbrush
