#include "tests/planner/workpieces.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "config/cell_file.h"

namespace hilbrush {

CellDescription default_cell() {
  return load_cell(HILBRUSH_SOURCE_DIR "/config/cells/default.json");
}

TexturedMesh revolve(const std::vector<std::array<double, 2>>& outline, int sides) {
  TexturedMesh mesh;
  for (const auto& [r, z] : outline)
    for (int i = 0; i < sides; ++i) {
      const double angle = 2 * std::numbers::pi * i / sides;
      mesh.vertices.emplace_back(r * std::cos(angle), r * std::sin(angle), z);
    }
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const auto& v = mesh.vertices;
    if ((v[b] - v[a]).cross(v[c] - v[a]).norm() > 1e-14) mesh.triangles.push_back({a, b, c});
  };
  const auto n = static_cast<std::uint32_t>(sides);
  for (std::uint32_t k = 0; k + 1 < outline.size(); ++k)
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t j = (i + 1) % n;
      add(k * n + i, k * n + j, (k + 1) * n + i);
      add(k * n + j, (k + 1) * n + j, (k + 1) * n + i);
    }
  return mesh;
}

TexturedMesh ball(double radius_m) {
  std::vector<std::array<double, 2>> outline;
  constexpr int kRings = 24;
  for (int k = 0; k <= kRings; ++k) {
    const double angle = std::numbers::pi * k / kRings;
    const double r = k % kRings == 0 ? 0 : radius_m * std::sin(angle);  // no pinholes at the poles
    outline.push_back({r, radius_m * (1 - std::cos(angle))});
  }
  return revolve(outline);
}

TexturedMesh small_cup() {
  return revolve({{0, 0},
                  {.018, 0},
                  {.01, .012},
                  {.01, .02},
                  {.018, .03},
                  {.02, .05},
                  {.018, .05},
                  {.016, .032},
                  {.008, .026},
                  {0, .025}});
}

TexturedMesh drilled_block() {
  return revolve({{0, 0}, {.02, 0}, {.02, .04}, {.004, .04}, {.004, .01}, {0, .01}}, 96);
}

DotSequence scatter(const TexturedMesh& mesh, double pitch_m, unsigned seed) {
  std::vector<Eigen::Vector3d> vertex_normals(mesh.vertices.size(), Eigen::Vector3d::Zero());
  std::vector<double> area_sum;
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
    for (const auto v : mesh.triangles[t]) vertex_normals[v] += mesh.area_vector(t);
    area_sum.push_back(sum += mesh.area_vector(t).norm());
  }
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  DotSequence dots;
  dots.pitch_m = pitch_m;
  const auto count = static_cast<std::size_t>(sum / (pitch_m * pitch_m));
  for (std::size_t i = 0; i < count; ++i) {
    const double at = sum * (static_cast<double>(i) + uniform(random)) / static_cast<double>(count);
    const auto t = static_cast<std::size_t>(
        std::min(std::lower_bound(area_sum.begin(), area_sum.end(), at), area_sum.end() - 1) -
        area_sum.begin());
    double v = uniform(random);
    double w = uniform(random);
    if (v + w > 1) {
      v = 1 - v;
      w = 1 - w;
    }
    const Eigen::Vector3d weights(1 - v - w, v, w);
    Dot dot;
    dot.position_O.setZero();
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    for (int c = 0; c < 3; ++c) {
      dot.position_O += weights[c] * mesh.corner(t, c);
      normal += weights[c] * vertex_normals[mesh.triangles[t][static_cast<std::size_t>(c)]].normalized();
    }
    dot.normal_O = mesh.area_vector(t).normalized().cast<float>();
    dot.smooth_normal_O = normal.normalized().cast<float>();
    dot.triangle = static_cast<std::uint32_t>(t);
    dot.tone = 1;
    dots.dots.push_back(dot);
  }
  return dots;
}

}  // namespace hilbrush
