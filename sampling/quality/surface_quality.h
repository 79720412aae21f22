#pragma once
#include <atomic>
#include <memory>

#include "sampling/model/edges.h"
#include "sampling/quality/quality.h"
#include "sampling/quality/triangle_tree.h"

namespace hilbrush {

/// The mass of each triangle, and whether it is spread evenly over it (a byte, as threads write them side by
/// side).
struct TriangleMasses {
  std::vector<double> masses;
  std::vector<std::uint8_t> is_even;
};

/// What SurfaceQuality keeps of its mesh.
struct SurfaceQuality::Implementation {
  Implementation(const TexturedMesh& m, const ToneField* t);
  Implementation(const TexturedMesh& m, const ToneField* t, TriangleMasses measured);

  const TexturedMesh& mesh;
  const ToneField* tone;              ///< null: area alone counts
  std::vector<std::uint8_t> is_even;  ///< by triangle
  std::vector<double> masses;         ///< by triangle
  std::vector<double> mass_sums;      ///< by triangle: of all up to this one
  double mass = 0;
  double diagonal_m = 0;  ///< of the bounding box
  Neighbors neighbors;
  TriangleTree tree;

  /// Mass of the part of a triangle within a ball.
  double mass_in_ball(std::uint32_t triangle, const Eigen::Vector3d& center, double radius) const;
  /// A surface point, random by mass, from three numbers of [0, 1).
  SurfacePoint random_point(double which, double u, double v) const;
  /// Asked density; 1 without a tone.
  double density(const SurfacePoint& point) const { return tone ? tone->asked(point) : 1; }
  double density_at(const Eigen::Vector3d& place, std::uint32_t triangle) const;
};

/// Area that a disc around the origin has in common with the triangle a, b, c (positive if
/// counter-clockwise). Closed form, side by side: a side gives the signed area of disc and triangle (origin,
/// a, b).
double disc_triangle_area(double radius, const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                          const Eigen::Vector2d& c);

}  // namespace hilbrush
