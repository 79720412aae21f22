#pragma once
#include <array>
#include <cmath>
#include <functional>
#include <initializer_list>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "sampling/model/textured_mesh.h"

/// Meshes for tests, by name: plain ones, and awkward ones. Meters; about 50 mm large.
namespace hilbrush::test {

inline constexpr double kPi = std::numbers::pi;

/// Fills in one material and a tone of `luminance` for all triangles.
inline TexturedMesh finish(TexturedMesh mesh, float luminance = 0) {
  const std::size_t n = mesh.triangles.size();
  mesh.corner_uv.resize(n, {Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()});
  mesh.corner_luminance.resize(n, {luminance, luminance, luminance});
  mesh.material_index.resize(n, 0);
  if (mesh.materials.empty()) {
    Material material;
    material.source = ColorSource::kColors;
    mesh.materials.push_back(material);
  }
  return mesh;
}

inline void add_quad(TexturedMesh& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  mesh.triangles.push_back({a, b, c});
  mesh.triangles.push_back({a, c, d});
}

/// A grid of nu by nv quads over position(u, v), u and v in [0, 1], closed in u or v if set. Corner uv are
/// (u, v).
inline TexturedMesh grid(int nu, int nv, const std::function<Eigen::Vector3d(double, double)>& position,
                         bool closes_u = false, bool closes_v = false) {
  TexturedMesh mesh;
  const int columns = closes_u ? nu : nu + 1;
  const int rows = closes_v ? nv : nv + 1;
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i)
      mesh.vertices.push_back(position(static_cast<double>(i) / nu, static_cast<double>(j) / nv));
  const auto index = [&](int i, int j) {
    return static_cast<std::uint32_t>(j % rows * columns + i % columns);
  };
  for (int j = 0; j < nv; ++j)
    for (int i = 0; i < nu; ++i) {
      add_quad(mesh, index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1));
      const double u0 = static_cast<double>(i) / nu;
      const double u1 = (i + 1.) / nu;
      const double v0 = static_cast<double>(j) / nv;
      const double v1 = (j + 1.) / nv;
      mesh.corner_uv.push_back({Eigen::Vector2d(u0, v0), Eigen::Vector2d(u1, v0), Eigen::Vector2d(u1, v1)});
      mesh.corner_uv.push_back({Eigen::Vector2d(u0, v0), Eigen::Vector2d(u1, v1), Eigen::Vector2d(u0, v1)});
    }
  return finish(std::move(mesh));
}

inline TexturedMesh rectangle(double width_m, double height_m, int nu, int nv) {
  return grid(nu, nv, [=](double u, double v) { return Eigen::Vector3d(u * width_m, v * height_m, 0); });
}

/// A sheet 2 by 1 sides large, folded along its middle, the y axis: `angle` between its halves, the lower one
/// on z = 0.
inline TexturedMesh folded_sheet(double side_m, double angle, int nu, int nv) {
  return grid(2 * nu, nv, [=](double u, double v) {
    const double along = (2 * u - 1) * side_m;
    const double y = v * side_m;
    return along < 0 ? Eigen::Vector3d(-along, y, 0)
                     : Eigen::Vector3d(along * std::cos(angle), y, along * std::sin(angle));
  });
}

inline TexturedMesh sphere(double radius_m, int nu = 48, int nv = 24) {
  TexturedMesh mesh;
  mesh.vertices.emplace_back(0, 0, -radius_m);
  for (int j = 1; j < nv; ++j)
    for (int i = 0; i < nu; ++i) {
      const double polar = kPi * j / nv;
      const double turn = 2 * kPi * i / nu;
      mesh.vertices.emplace_back(radius_m * std::sin(polar) * std::cos(turn),
                                 radius_m * std::sin(polar) * std::sin(turn), -radius_m * std::cos(polar));
    }
  mesh.vertices.emplace_back(0, 0, radius_m);
  const auto ring = [&](int j, int i) { return static_cast<std::uint32_t>(1 + (j - 1) * nu + i % nu); };
  const auto top = static_cast<std::uint32_t>(mesh.vertices.size() - 1);
  for (int i = 0; i < nu; ++i) {
    mesh.triangles.push_back({0, ring(1, i + 1), ring(1, i)});
    for (int j = 1; j + 1 < nv; ++j)
      add_quad(mesh, ring(j, i), ring(j, i + 1), ring(j + 1, i + 1), ring(j + 1, i));
    mesh.triangles.push_back({top, ring(nv - 1, i), ring(nv - 1, i + 1)});
  }
  return finish(std::move(mesh));
}

inline TexturedMesh torus(double large_m = .03, double small_m = .012, int nu = 48, int nv = 24) {
  return grid(
      nu, nv,
      [=](double u, double v) {
        const double r = large_m + small_m * std::cos(2 * kPi * v);
        return Eigen::Vector3d(r * std::cos(2 * kPi * u), r * std::sin(2 * kPi * u),
                               small_m * std::sin(2 * kPi * v));
      },
      true, true);
}

/// Open at both ends. needle_cylinder() has triangles as high as the cylinder and a thousandth as wide;
/// even_cylinder() the same shape.
inline TexturedMesh cylinder(double radius_m, double height_m, int nu, int nv) {
  return grid(
      nu, nv,
      [=](double u, double v) {
        return Eigen::Vector3d(radius_m * std::cos(2 * kPi * u), radius_m * std::sin(2 * kPi * u),
                               v * height_m);
      },
      true);
}
inline TexturedMesh needle_cylinder() {
  return cylinder(.02, .05, 720, 1);
}
inline TexturedMesh even_cylinder() {
  return cylinder(.02, .05, 180, 72);
}

inline TexturedMesh moebius_strip(int nu = 60) {
  TexturedMesh mesh = grid(nu, 2, [](double u, double v) {
    const double turn = 2 * kPi * u;
    const double across = (v - .5) * .012;
    const double r = .02 + across * std::cos(turn / 2);
    return Eigen::Vector3d(r * std::cos(turn), r * std::sin(turn), across * std::sin(turn / 2));
  });
  // The last column lies on the first one, upside down.
  for (int j = 0; j < 3; ++j)
    mesh.vertices[static_cast<std::size_t>(j * (nu + 1) + nu)] =
        mesh.vertices[static_cast<std::size_t>((2 - j) * (nu + 1))];
  return mesh;
}

inline TexturedMesh cube(double side_m = .04) {
  TexturedMesh mesh;
  for (unsigned k = 0; k < 8; ++k)
    mesh.vertices.emplace_back(side_m * (k & 1u), side_m * (k >> 1u & 1u), side_m * (k >> 2u & 1u));
  add_quad(mesh, 0, 2, 3, 1);
  add_quad(mesh, 4, 5, 7, 6);
  add_quad(mesh, 0, 1, 5, 4);
  add_quad(mesh, 2, 6, 7, 3);
  add_quad(mesh, 0, 4, 6, 2);
  add_quad(mesh, 1, 3, 7, 5);
  return finish(std::move(mesh));
}

inline TexturedMesh without_triangles(const TexturedMesh& mesh,
                                      const std::function<bool(const Eigen::Vector3d&)>& is_dropped) {
  TexturedMesh kept = mesh;
  kept.triangles.clear();
  kept.corner_uv.clear();
  kept.corner_luminance.clear();
  kept.material_index.clear();
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
    if (is_dropped((mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3)) continue;
    kept.triangles.push_back(mesh.triangles[t]);
    kept.corner_uv.push_back(mesh.corner_uv[t]);
    kept.corner_luminance.push_back(mesh.corner_luminance[t]);
    kept.material_index.push_back(mesh.material_index[t]);
  }
  return kept;
}

/// A square plate with three round holes.
inline TexturedMesh plate_with_holes() {
  return without_triangles(rectangle(.05, .05, 60, 60), [](const Eigen::Vector3d& p) {
    for (const auto& [x, y, r] :
         {std::array{.012, .012, .006}, std::array{.035, .02, .009}, std::array{.02, .04, .004}})
      if (std::hypot(p.x() - x, p.y() - y) < r) return true;
    return false;
  });
}

/// All triangles of both, unconnected.
inline TexturedMesh both(const TexturedMesh& a, const TexturedMesh& b,
                         const Eigen::Vector3d& shift_b = Eigen::Vector3d::Zero()) {
  TexturedMesh mesh = a;
  const auto first = static_cast<std::uint32_t>(a.vertices.size());
  for (const auto& p : b.vertices) mesh.vertices.push_back(p + shift_b);
  for (auto t : b.triangles) mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  mesh.corner_uv.insert(mesh.corner_uv.end(), b.corner_uv.begin(), b.corner_uv.end());
  mesh.corner_luminance.insert(mesh.corner_luminance.end(), b.corner_luminance.begin(),
                               b.corner_luminance.end());
  mesh.material_index.insert(mesh.material_index.end(), b.material_index.begin(), b.material_index.end());
  return mesh;
}

/// Every triangle with three vertices of its own, as STL has it.
inline TexturedMesh soup(const TexturedMesh& mesh) {
  TexturedMesh result = mesh;
  result.vertices.clear();
  for (auto& triangle : result.triangles)
    for (auto& v : triangle) {
      result.vertices.push_back(mesh.vertices[v]);
      v = static_cast<std::uint32_t>(result.vertices.size() - 1);
    }
  return result;
}

/// Gives all triangles one texture with the tones of `luminance(i, j)`.
inline TexturedMesh with_texture(TexturedMesh mesh, int width, int height,
                                 const std::function<double(int, int)>& luminance, bool repeat_u = true,
                                 bool repeat_v = true) {
  Texture texture;
  texture.width = width;
  texture.height = height;
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < width; ++i) texture.luminance.push_back(static_cast<float>(luminance(i, j)));
  Material material;
  material.source = ColorSource::kTexture;
  material.texture = 0;
  material.repeat_u = repeat_u;
  material.repeat_v = repeat_v;
  mesh.textures = {texture};
  mesh.materials = {material};
  return mesh;
}

/// All that sampling must survive, by name.
inline std::map<std::string, TexturedMesh> awkward_meshes() {
  std::map<std::string, TexturedMesh> meshes;
  meshes["sphere"] = sphere(.025);
  meshes["torus"] = torus();
  meshes["cube"] = cube();
  meshes["needle cylinder"] = needle_cylinder();
  meshes["moebius strip"] = moebius_strip();
  meshes["plate with holes"] = plate_with_holes();
  meshes["long strip"] = rectangle(.05, .002, 50, 2);
  meshes["one triangle"] =
      without_triangles(rectangle(.05, .05, 1, 1), [](const Eigen::Vector3d& p) { return p.x() < p.y(); });
  meshes["soup of a sphere"] = soup(sphere(.025, 20, 10));
  meshes["cubes that share an edge"] = both(cube(), cube(), {.04, .04, 0});
  meshes["cubes that share a corner"] = both(cube(), cube(), {.04, .04, .04});
  meshes["spheres apart"] = both(sphere(.01), sphere(.02), {.05, 0, 0});
  TexturedMesh fan = rectangle(.05, .05, 40, 40);
  fan.vertices.emplace_back(.0125, .0125, .03);
  fan.triangles.push_back({0, 1, static_cast<std::uint32_t>(fan.vertices.size() - 1)});
  fan.triangles.push_back({20 * 41 + 20, 20 * 41 + 21, static_cast<std::uint32_t>(fan.vertices.size() - 1)});
  meshes["three triangles on an edge"] = finish(fan);
  return meshes;
}

}  // namespace hilbrush::test
