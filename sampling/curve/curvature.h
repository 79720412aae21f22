#pragma once
#include <array>
#include <vector>

#include "sampling/model/textured_mesh.h"
#include "sampling/options/sample_options.h"

/// Curvature of a mesh, and dots that follow it instead of a picture (the thesis, section 6.1.3): more dots
/// where the surface bends. The mesh is repaired: triangles that touch share vertices and face the same way.
namespace hilbrush {

/// Per triangle and corner, so that a vertex where two surfaces only touch has one value for each.
struct Curvature {
  std::vector<std::array<double, 3>> mean;      ///< 1/m; positive where the surface is convex
  std::vector<std::array<double, 3>> gaussian;  ///< 1/m^2
};

/// Gaussian: angle defect over the mixed Voronoi area of Meyer et al. (equations 6.4 and 6.5's cases; the
/// thesis prints a third of an obtuse triangle for its acute corners where Meyer et al. and this take a
/// quarter, which adds up). Mean: lengths of edges times their dihedral angles (Cohen-Steiner and Morvan
/// 2003) over the same area: it needs no cotangents, so slivers do it no harm, and it is exact on prisms and
/// cylinders. Both are averaged, by area, over a vertex and its neighbors. A boundary has no angle defect of
/// its own: its vertices get their neighbors' Gaussian curvature. Differs from the thesis, which fits a
/// quadric (unsteady on few or thin triangles). Cost O(triangles).
Curvature measure_curvature(const TexturedMesh& mesh);

/// The same surface in a tone proportional to |mean| or |gaussian| curvature: black where it is at or above
/// the value that 95 % of the area stays below, white where the surface is flat. The thesis's density is
/// relative, so it neither scales nor clips; without a clip a few sharp vertices would take the dots of all
/// the rest. With the tone curve of some paint the dots follow the curvature as that paint shows it. A
/// surface that is flat everywhere is white. kTexture returns the mesh as it is.
TexturedMesh with_curvature_density(const TexturedMesh& mesh, DensitySource source);

}  // namespace hilbrush
