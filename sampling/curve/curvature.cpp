#include "sampling/curve/curvature.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>

#include "sampling/disk/components.h"

namespace hilbrush {
namespace {

using Eigen::Vector3d;

constexpr double kBlackAbove = .95;  ///< share of the area with less curvature than what is black
/// A radius of curvature above this, in units of the root of the surface's area, is taken for rounding.
constexpr double kFlatRadius = 1e4;

/// What belongs to a vertex: integrals over its mixed area.
struct VertexIntegrals {
  double area = 0;
  double mean = 0;    ///< of H
  double angles = 0;  ///< of all triangles around it
  bool is_boundary = false;
};

/// Angle at corner c of a triangle.
double angle_at(const TexturedMesh& mesh, std::size_t t, int c) {
  const Vector3d a = mesh.corner(t, (c + 1) % 3) - mesh.corner(t, c),
                 b = mesh.corner(t, (c + 2) % 3) - mesh.corner(t, c);
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// How a triangle's area is shared among its corners: equation 6.4; the halves and quarters of Meyer et al.
/// if it is obtuse.
std::array<double, 3> mixed_areas(const TexturedMesh& mesh, std::size_t t) {
  const double area = mesh.area_vector(t).norm();
  std::array<double, 3> dots{}, lengths2{};  // at corner c; of the side opposite to it
  for (int c = 0; c < 3; ++c) {
    const Vector3d a = mesh.corner(t, (c + 1) % 3) - mesh.corner(t, c),
                   b = mesh.corner(t, (c + 2) % 3) - mesh.corner(t, c);
    dots[static_cast<std::size_t>(c)] = a.dot(b);
    lengths2[static_cast<std::size_t>(c)] = (a - b).squaredNorm();
  }
  for (std::size_t c = 0; c < 3; ++c)
    if (dots[c] <= 0) {
      std::array<double, 3> shares{area / 4, area / 4, area / 4};
      shares[c] = area / 2;
      return shares;
    }
  std::array<double, 3> shares{};
  for (std::size_t c = 0; c < 3; ++c)
    for (const std::size_t other : {(c + 1) % 3, (c + 2) % 3})  // cot = dot / (2 area)
      shares[c] += lengths2[other] * dots[other] / (16 * area);
  return shares;
}

/// Length times dihedral angle of side `side`; positive if convex.
double bend(const TexturedMesh& mesh, std::uint32_t t, int side, std::uint32_t across) {
  const Vector3d edge = mesh.corner(t, (side + 1) % 3) - mesh.corner(t, side);
  const Vector3d n = mesh.area_vector(t), m = mesh.area_vector(across);
  const double length = edge.norm();
  if (!(length > 0)) return 0;
  return length * std::atan2(n.cross(m).dot(edge) / length, n.dot(m));
}

std::vector<VertexIntegrals> integrate_around(const TexturedMesh& mesh, const Neighbors& neighbors,
                                              const Fans& fans) {
  std::vector<VertexIntegrals> vertices(fans.count);
  for (std::uint32_t t = 0; t < mesh.triangle_count(); ++t) {
    const std::array<double, 3> areas = mixed_areas(mesh, t);
    for (std::size_t c = 0; c < 3; ++c) {
      VertexIntegrals& vertex = vertices[fans.of_corners[t][c]];
      vertex.area += std::isfinite(areas[c]) ? areas[c] : 0;
      vertex.angles += angle_at(mesh, t, static_cast<int>(c));
    }
    for (std::size_t side = 0; side < 3; ++side) {
      VertexIntegrals &from = vertices[fans.of_corners[t][side]],
                      &to = vertices[fans.of_corners[t][(side + 1) % 3]];
      const TriangleSide across = neighbors[t][side];
      if (across == kNoSide) {
        from.is_boundary = to.is_boundary = true;
        continue;
      }
      // Half of the sum over edges is the integral of H; each edge is met twice and has two ends.
      const double share = bend(mesh, t, static_cast<int>(side), across.triangle) / 8;
      from.mean += share;
      to.mean += share;
    }
  }
  return vertices;
}

/// Sums over a vertex and those next to it.
struct RingSums {
  double area = 0, mean = 0, inner_area = 0, defect = 0;

  void add(const VertexIntegrals& vertex) {
    area += vertex.area;
    mean += vertex.mean;
    if (vertex.is_boundary) return;
    inner_area += vertex.area;
    defect += 2 * std::numbers::pi - vertex.angles;
  }
};

}  // namespace

Curvature measure_curvature(const TexturedMesh& mesh) {
  const Neighbors neighbors = find_neighbors(mesh.triangles);
  const Fans fans = find_fans(neighbors);
  const std::vector<VertexIntegrals> vertices = integrate_around(mesh, neighbors, fans);
  std::vector<RingSums> rings(vertices.size());
  for (std::size_t v = 0; v < vertices.size(); ++v) rings[v].add(vertices[v]);
  for (std::uint32_t t = 0; t < mesh.triangle_count(); ++t)
    for (std::size_t side = 0; side < 3; ++side) {
      const std::uint32_t from = fans.of_corners[t][side], to = fans.of_corners[t][(side + 1) % 3];
      rings[from].add(vertices[to]);
      // An edge with a triangle on its other side is met from there too.
      if (neighbors[t][side] == kNoSide) rings[to].add(vertices[from]);
    }
  Curvature curvature;
  curvature.mean.resize(mesh.triangle_count());
  curvature.gaussian.resize(mesh.triangle_count());
  for (std::uint32_t t = 0; t < mesh.triangle_count(); ++t)
    for (std::size_t c = 0; c < 3; ++c) {
      const RingSums& ring = rings[fans.of_corners[t][c]];
      curvature.mean[t][c] = ring.area > 0 ? ring.mean / ring.area : 0;
      curvature.gaussian[t][c] = ring.inner_area > 0 ? ring.defect / ring.inner_area : 0;
    }
  return curvature;
}

namespace {

/// The value that `share` of the surface's area stays below.
double quantile_by_area(const TexturedMesh& mesh, const std::vector<std::array<double, 3>>& of_corners,
                        double share) {
  std::vector<std::pair<double, double>> values_and_areas;
  double total = 0;
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
    const double area = mesh.area_vector(t).norm();
    for (const double value : of_corners[t]) values_and_areas.emplace_back(value, area / 3);
    total += area;
  }
  std::sort(values_and_areas.begin(), values_and_areas.end());
  double passed = 0;
  for (const auto& [value, area] : values_and_areas) {
    passed += area;
    if (passed >= share * total) return value;
  }
  return 0;
}

}  // namespace

TexturedMesh with_curvature_density(const TexturedMesh& mesh, DensitySource source) {
  if (source == DensitySource::kTexture) return mesh;
  const bool is_mean = source == DensitySource::kMeanCurvature;
  Curvature curvature = measure_curvature(mesh);
  std::vector<std::array<double, 3>>& of_corners = is_mean ? curvature.mean : curvature.gaussian;
  for (auto& corners : of_corners)
    for (double& value : corners) value = std::abs(value);
  const double black = quantile_by_area(mesh, of_corners, kBlackAbove);
  const double size = std::sqrt(mesh.area_m2());
  const double flat = 1 / (kFlatRadius * size);
  const bool is_flat = !(black > (is_mean ? flat : flat * flat));

  TexturedMesh result = mesh;
  result.textures.clear();
  for (Material& material : result.materials) {
    material.source = ColorSource::kColors;
    material.texture = -1;
  }
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t)
    for (std::size_t c = 0; c < 3; ++c) {
      const double tone = is_flat ? 0 : std::min(1., of_corners[t][c] / black);
      result.corner_luminance[t][c] = static_cast<float>(1 - tone);
    }
  return result;
}

}  // namespace hilbrush
