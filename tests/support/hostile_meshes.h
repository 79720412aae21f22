#pragma once
#include <set>
#include <tuple>

#include "tests/support/meshes.h"

/// Meshes that break samplers, by name: each needs one repair or one case of cutting and mapping. Meters.
namespace hilbrush::test {

/// Two squares that touch in a corner.
inline TexturedMesh bow_tie() {
  TexturedMesh mesh;
  mesh.vertices = {{0, 0, 0},     {.02, 0, 0},   {.02, .02, 0}, {0, .02, 0},
                   {.04, .02, 0}, {.04, .04, 0}, {.02, .04, 0}};
  add_quad(mesh, 0, 1, 2, 3);
  add_quad(mesh, 2, 4, 5, 6);
  return finish(std::move(mesh));
}

/// Closed and one-sided, passing through itself: a figure of eight swept around with half a turn.
inline TexturedMesh klein_bottle(int nu = 60, int nv = 24) {
  TexturedMesh mesh = grid(
      nu, nv,
      [nv](double u, double v) {
        const double turn = 2 * kPi * u;
        const double a = 2 * kPi * (v + .5 / nv);  // no vertex lies where it passes through itself
        const double c = std::cos(turn / 2);
        const double s = std::sin(turn / 2);
        const double r = .025 + .01 * (c * std::sin(a) - s * std::sin(2 * a));
        return Eigen::Vector3d(r * std::cos(turn), r * std::sin(turn),
                               .01 * (s * std::sin(a) + c * std::sin(2 * a)));
      },
      false, true);
  // The last column lies on the first one, upside down.
  const auto at = [&](int i, int j) { return static_cast<std::size_t>((j + nv) % nv * (nu + 1) + i); };
  for (int j = 0; j < nv; ++j) mesh.vertices[at(nu, j)] = mesh.vertices[at(0, nv - 1 - j)];
  return mesh;
}

/// A disk of `count` needles around one vertex.
inline TexturedMesh needle_fan(int count = 2000) {
  TexturedMesh mesh;
  mesh.vertices.emplace_back(0, 0, 0);
  for (int i = 0; i < count; ++i)
    mesh.vertices.emplace_back(.025 * std::cos(2 * kPi * i / count), .025 * std::sin(2 * kPi * i / count), 0);
  for (int i = 0; i < count; ++i)
    mesh.triangles.push_back(
        {0, static_cast<std::uint32_t>(1 + i), static_cast<std::uint32_t>(1 + (i + 1) % count)});
  return finish(std::move(mesh));
}

/// A cube with every triangle twice, the second time upside down.
inline TexturedMesh duplicate_faces() {
  TexturedMesh mesh = cube();
  for (std::size_t t = 0; t < 12; ++t) {
    const auto face = mesh.triangles[t];
    mesh.triangles.push_back({face[0], face[2], face[1]});
  }
  return finish(std::move(mesh));
}

/// Two squares beside one with sides twice as long, whose edge has a vertex in the middle on one side only.
inline TexturedMesh t_junction() {
  TexturedMesh mesh;
  mesh.vertices = {{0, 0, 0},   {.04, 0, 0},   {.04, .04, 0}, {0, .04, 0},
                   {.06, 0, 0}, {.06, .02, 0}, {.04, .02, 0}, {.06, .04, 0}};
  add_quad(mesh, 0, 1, 2, 3);
  add_quad(mesh, 1, 4, 5, 6);
  add_quad(mesh, 6, 5, 7, 2);
  return finish(std::move(mesh));
}

inline TexturedMesh inside_out_cube() {
  TexturedMesh mesh = cube();
  for (auto& face : mesh.triangles) std::swap(face[1], face[2]);
  return mesh;
}

/// Three pages of a book: their common spine is an edge of six triangles, twice.
inline TexturedMesh three_pages() {
  TexturedMesh mesh;
  for (int j = 0; j <= 2; ++j) mesh.vertices.emplace_back(0, 0, .02 * j);
  for (int k = 0; k < 3; ++k) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (int j = 0; j <= 2; ++j)
      mesh.vertices.emplace_back(.03 * std::cos(2 * kPi * k / 3), .03 * std::sin(2 * kPi * k / 3), .02 * j);
    for (std::uint32_t j = 0; j < 2; ++j) add_quad(mesh, j, first + j, first + j + 1, j + 1);
  }
  return finish(std::move(mesh));
}

/// A torus with one meridian shrunk to a point: a sphere that touches itself.
inline TexturedMesh pinched_torus() {
  TexturedMesh mesh = torus(.025, .01, 48, 24);
  for (auto& p : mesh.vertices)
    if (std::abs(p.y()) < 1e-9 && p.x() > 0) p = {.025, 0, 0};
  return mesh;
}

/// The surface of cubes at the given positions on a grid; common vertices are shared.
inline TexturedMesh voxels(const std::set<std::array<int, 3>>& cubes, double side_m = .01) {
  TexturedMesh mesh;
  std::map<std::array<int, 3>, std::uint32_t> index;
  const auto vertex = [&](std::array<int, 3> p) {
    const auto [at, is_new] = index.try_emplace(p, static_cast<std::uint32_t>(mesh.vertices.size()));
    if (is_new) mesh.vertices.emplace_back(side_m * p[0], side_m * p[1], side_m * p[2]);
    return at->second;
  };
  for (const auto& position : cubes)
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (const int side : {0, 1}) {
        auto beside = position;
        beside[axis] += side ? 1 : -1;
        if (cubes.contains(beside)) continue;
        std::array<std::uint32_t, 4> corners{};
        for (std::size_t k = 0; k < 4; ++k) {
          auto p = position;
          p[axis] += side;
          p[(axis + 1) % 3] += k == 1 || k == 2;
          p[(axis + 2) % 3] += k >= 2;
          corners[side ? k : 3 - k] = vertex(p);
        }
        add_quad(mesh, corners[0], corners[1], corners[2], corners[3]);
      }
  return finish(std::move(mesh));
}

/// A plate with `holes` square holes in a row: a surface of that genus.
inline TexturedMesh holed_plate(int holes) {
  std::set<std::array<int, 3>> cubes;
  for (int i = 0; i < 2 * holes + 1; ++i)
    for (int j = 0; j < 3; ++j)
      if (i % 2 == 0 || j != 1) cubes.insert({i, j, 0});
  return voxels(cubes);
}
inline TexturedMesh double_torus() {
  return holed_plate(2);
}

/// The largest triangle has a million times the area of the smallest.
inline TexturedMesh sliver_1e6() {
  const auto stretched = [](double u) {
    return .05 * std::expm1(std::log(1e3) * 31. / 30 * u) / std::expm1(std::log(1e3) * 31. / 30);
  };
  return grid(31, 31, [=](double u, double v) { return Eigen::Vector3d(stretched(u), stretched(v), 0); });
}

/// A plate with `n` by `n` holes.
inline TexturedMesh many_holes(int n = 9) {
  return without_triangles(rectangle(.05, .05, 4 * n, 4 * n), [=](const Eigen::Vector3d& p) {
    const auto in_hole = [&](double x) {
      const double share = x / .05 * n;
      return std::abs(share - std::floor(share) - .5) < .25;
    };
    return in_hole(p.x()) && in_hole(p.y());
  });
}

/// A polygon cut into ears: every inner edge connects two vertices of the boundary.
inline TexturedMesh chord_trap(std::uint32_t corners = 24) {
  TexturedMesh mesh;
  for (std::uint32_t i = 0; i < corners; ++i)
    mesh.vertices.emplace_back(.02 * std::cos(2 * kPi * i / corners), .02 * std::sin(2 * kPi * i / corners),
                               0);
  for (std::uint32_t i = 1; i + 1 < corners; ++i) mesh.triangles.push_back({0, i, i + 1});
  return finish(std::move(mesh));
}

/// A square whose one long edge is closed against two short ones by a triangle without area.
inline TexturedMesh zero_area_cap() {
  TexturedMesh mesh = t_junction();
  mesh.triangles.push_back({1, 6, 2});
  return finish(std::move(mesh));
}

inline TexturedMesh single_triangle() {
  TexturedMesh mesh;
  mesh.vertices = {{0, 0, 0}, {.03, 0, 0}, {0, .02, 0}};
  mesh.triangles = {{0, 1, 2}};
  return finish(std::move(mesh));
}

/// A sphere whose pole is a ring of vertices that differ only by rounding.
inline TexturedMesh frayed_pole() {
  return grid(
      48, 24,
      [](double u, double v) {
        return Eigen::Vector3d(.025 * std::sin(kPi * v) * std::cos(2 * kPi * u),
                               .025 * std::sin(kPi * v) * std::sin(2 * kPi * u), -.025 * std::cos(kPi * v));
      },
      true);
}

/// A plate with a finger so long and thin that a conformal map shrinks its tip below the last digit.
inline TexturedMesh long_finger() {
  // Along the profile: in over the plate, up the finger, in over its tip.
  return grid(
      24, 400,
      [](double u, double v) {
        const double turn = 2 * kPi * u;
        const double along_m = .1 * v;
        const double r = along_m < .02 ? .021 - along_m : .001;
        const double z = std::max(0., along_m - .02);
        return Eigen::Vector3d(r * std::cos(turn), r * std::sin(turn), z);
      },
      true);
}

/// A bag: a sphere with a mouth of a thousandth of its area.
inline TexturedMesh bag() {
  return without_triangles(sphere(.025, 96, 48), [](const Eigen::Vector3d& p) { return p.z() > .0249; });
}

/// A square of n by n triangles that are not connected.
inline TexturedMesh specks(int n = 100) {
  TexturedMesh mesh;
  const double step = .05 / n;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
      mesh.vertices.emplace_back(step * i, step * j, 0);
      mesh.vertices.emplace_back(step * (i + .8), step * j, 0);
      mesh.vertices.emplace_back(step * i, step * (j + .8), 0);
      mesh.triangles.push_back({first, first + 1, first + 2});
    }
  return finish(std::move(mesh));
}

}  // namespace hilbrush::test
