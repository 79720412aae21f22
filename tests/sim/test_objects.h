#pragma once
#include <cmath>
#include <numbers>
#include <vector>

#include "planner/cell_model/cell_description.h"
#include "sampling/base/angles.h"
#include "sampling/model/textured_mesh.h"
#include "sim/devices/emission_record.h"

/// A small cell and simple objects for the tests of sim/, made by hand so that they test nothing else.
namespace hilbrush::test {

inline CellDescription handmade_cell() {
  CellDescription cell;
  cell.name = "test";
  const AxisDescription turn{-180 * kDegree, 180 * kDegree, 720 * kDegree, 8000 * kDegree, 10 * kDegree, 0};
  cell.axes = {turn, turn, {-.1, .4, 1.1, 18, .02, .2}, turn, turn, turn};
  cell.arm = {.225, .175, 30 * kDegree, .1, .015, .25, {}, {}, {}};
  cell.lens = {.015, .06, .14};
  cell.table.tilt_axis_W = {.26, 0, .05};
  cell.table.plate_height_m = .01;
  cell.fixture = {.05, .005};
  cell.laser = {.01, 10, 1e-4, 1, .005, std::nullopt, 1.41};
  cell.paint.dose_full_j_m2 = 1000;
  cell.paint.asked_max = 1.5;
  cell.timing = {.004, .02, .12, .12, .001};
  cell.simulation.time_scale = 0;
  return cell;
}

/// Adds a quad a b c d (counter-clockwise seen from outside) of luminance `luminance`.
inline void add_quad(TexturedMesh& mesh, const std::array<Eigen::Vector3d, 4>& corners, float luminance = 0) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), corners.begin(), corners.end());
  for (const std::array<std::uint32_t, 3> triangle : {std::array<std::uint32_t, 3>{0, 1, 2}, {0, 2, 3}}) {
    mesh.triangles.push_back({first + triangle[0], first + triangle[1], first + triangle[2]});
    mesh.corner_uv.push_back({Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()});
    mesh.corner_luminance.push_back({luminance, luminance, luminance});
    mesh.material_index.push_back(0);
  }
  if (mesh.materials.empty()) mesh.materials.push_back({.name = "paint", .source = ColorSource::kColors});
}

/// A square of side `size` in the plane z = height, centered on the axis, facing up.
inline TexturedMesh square(double size, double height = 0, float luminance = 0) {
  TexturedMesh mesh;
  const double r = size / 2;
  add_quad(mesh, {Eigen::Vector3d{-r, -r, height}, {r, -r, height}, {r, r, height}, {-r, r, height}},
           luminance);
  return mesh;
}

/// A ball around (0, 0, radius), facing outwards, of 2 * rings * rings triangles or so.
inline TexturedMesh ball(double radius, int rings) {
  TexturedMesh mesh;
  const int around = 2 * rings;
  const auto place = [&](int i, int j) {
    const double polar = std::numbers::pi * i / rings;
    const double azimuth = 2 * std::numbers::pi * j / around;
    return Eigen::Vector3d(radius * std::sin(polar) * std::cos(azimuth),
                           radius * std::sin(polar) * std::sin(azimuth), radius + radius * std::cos(polar));
  };
  for (int i = 0; i < rings; ++i)
    for (int j = 0; j < around; ++j) {
      TexturedMesh quad;
      add_quad(quad, {place(i, j), place(i + 1, j), place(i + 1, j + 1), place(i, j + 1)});
      for (int half = 0; half < 2; ++half) {
        if ((i == 0 && half == 1) || (i == rings - 1 && half == 0))
          continue;  // the poles' quads are triangles
        const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
        for (int c = 0; c < 3; ++c) mesh.vertices.push_back(quad.corner(half, c));
        mesh.triangles.push_back({first, first + 1, first + 2});
        mesh.corner_uv.push_back(quad.corner_uv[half]);
        mesh.corner_luminance.push_back(quad.corner_luminance[half]);
        mesh.material_index.push_back(0);
      }
    }
  mesh.materials.push_back({.name = "paint", .source = ColorSource::kColors});
  return mesh;
}

/// An even lattice of places on all triangles, some `step_m` apart.
template <class Visit>  // (const SurfacePoint&, double area_m2)
void visit_surface(const TexturedMesh& mesh, double step_m, Visit visit) {
  for (std::uint32_t t = 0; t < mesh.triangle_count(); ++t) {
    const double area = mesh.area_vector(t).norm();
    const int n = 1 + static_cast<int>(2 * std::sqrt(area) / step_m);
    // n * n small triangles of equal area, each by its centroid.
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < 2 * (n - i) - 1; ++j) {
        const double third = j % 2 == 0 ? 1. / 3 : 2. / 3;
        const double u = (i + third) / n;
        const double v = (j / 2 + third) / n;
        visit(SurfacePoint{t, {1 - u - v, u, v}}, area / (static_cast<double>(n) * n));
      }
  }
}

}  // namespace hilbrush::test
