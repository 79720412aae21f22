#include "sampling/model/files/face_list.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sampling/base/input_error.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();

double linear_of_srgb(double encoded) {
  const double c = encoded > 0 ? std::min(encoded, 1.) : 0.;  // not a number is black
  return c <= .04045 ? c / 12.92 : std::pow((c + .055) / 1.055, 2.4);
}

bool is_usable(const Vector3d& p) {
  return p.allFinite() && p.cwiseAbs().maxCoeff() < kMaxCoordinate;
}

}  // namespace

float luminance_of_srgb(double red, double green, double blue) {
  return static_cast<float>(.2126 * linear_of_srgb(red) + .7152 * linear_of_srgb(green) +
                            .0722 * linear_of_srgb(blue));
}

std::vector<Vector2d> bounding_box_mapping(const std::vector<Vector3d>& points,
                                           const std::vector<std::uint32_t>& corners) {
  if (corners.empty()) return {};
  Vector3d low = points[corners[0]];
  Vector3d high = low;
  for (const std::uint32_t corner : corners) {
    low = low.cwiseMin(points[corner]);
    high = high.cwiseMax(points[corner]);
  }
  const Vector3d size = high - low;
  // Of equal sides x goes before y before z.
  std::array<int, 3> order{0, 1, 2};
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return size[a] > size[b]; });
  const double scale = size[order[0]] > 0 ? 1 / size[order[0]] : 0;
  std::vector<Vector2d> uv;
  uv.reserve(corners.size());
  for (const std::uint32_t corner : corners) {
    const Vector3d p = points[corner] - low;
    uv.emplace_back(p[order[0]] * scale, p[order[1]] * scale);
  }
  return uv;
}

int MeshBuilder::add_texture(Texture texture) {
  mesh_.textures.push_back(std::move(texture));
  return static_cast<int>(mesh_.textures.size()) - 1;
}

std::uint32_t MeshBuilder::material_of(const FaceList& faces, const Look& look) {
  Material material;
  material.name = look.name;
  material.texture = look.texture;
  material.repeat_u = look.repeat_u;
  material.repeat_v = look.repeat_v;
  material.opacity = look.opacity;
  material.source = look.texture >= 0                 ? ColorSource::kTexture
                    : !faces.corner_luminance.empty() ? ColorSource::kColors
                                                      : look.source;
  const MaterialKey key{static_cast<int>(material.source),
                        material.texture,
                        material.repeat_u,
                        material.repeat_v,
                        material.opacity,
                        material.name};
  const auto [found, is_new] =
      material_indices_.try_emplace(key, static_cast<std::uint32_t>(mesh_.materials.size()));
  if (is_new) mesh_.materials.push_back(std::move(material));
  return found->second;
}

std::vector<std::uint32_t> MeshBuilder::add_vertices(const FaceList& faces, const Eigen::Affine3d& X) {
  std::vector<std::uint32_t> vertex_of_point(faces.points.size(), kUnused);
  for (const std::uint32_t corner : faces.corners) {
    if (vertex_of_point[corner] != kUnused) continue;
    const Vector3d p = X * faces.points[corner];
    if (!is_usable(p)) continue;
    vertex_of_point[corner] = static_cast<std::uint32_t>(mesh_.vertices.size());
    mesh_.vertices.push_back(p);
  }
  return vertex_of_point;
}

void MeshBuilder::add(const FaceList& faces, const Eigen::Affine3d& X, const Look& look) {
  if (mesh_.vertices.size() + faces.points.size() >= kUnused)
    throw InputError(faces.at, "the model has too many points");
  const std::uint32_t material = material_of(faces, look);
  const std::vector<std::uint32_t> vertex_of_point = add_vertices(faces, X);
  FaceList mapped;
  const FaceList* source = &faces;
  if (look.texture >= 0 && faces.corner_uv.empty() && faces.maps_bounding_box) {
    mapped = faces;
    mapped.corner_uv = bounding_box_mapping(faces.points, faces.corners);
    source = &mapped;
  }
  const bool is_flipped = faces.is_reversed != (X.linear().determinant() < 0);

  std::size_t begin = 0;
  for (const std::size_t end : faces.face_ends) {
    const bool is_usable_face = take_outline(faces, begin, end, vertex_of_point);
    begin = end;
    if (!is_usable_face) continue;
    if (mesh_.triangles.size() + kept_.size() - 2 > limits_.triangles)
      throw InputError(faces.at,
                       "the model has more triangles than the limit of " + std::to_string(limits_.triangles));
    for (const auto& [a, b, c] : cutter_.cut(outline_)) {
      add_triangle(*source, look, {kept_[a], kept_[b], kept_[c]}, is_flipped, vertex_of_point);
      mesh_.material_index.push_back(material);
    }
  }
}

bool MeshBuilder::take_outline(const FaceList& faces, std::size_t begin, std::size_t end,
                               const std::vector<std::uint32_t>& vertex_of_point) {
  kept_.clear();
  bool is_finite = true;
  for (std::size_t c = begin; c < end; ++c) {
    if (!kept_.empty() && faces.corners[kept_.back()] == faces.corners[c]) continue;
    kept_.push_back(c);
    is_finite = is_finite && vertex_of_point[faces.corners[c]] != kUnused;
  }
  while (kept_.size() > 1 && faces.corners[kept_.front()] == faces.corners[kept_.back()]) kept_.pop_back();
  if (!is_finite) {
    ++infinite_face_count_;
    return false;
  }
  if (kept_.size() < 3) {
    if (short_face_count_++ == 0) first_short_face_ = faces.at;
    return false;
  }
  outline_.clear();
  for (const std::size_t c : kept_) outline_.push_back(faces.points[faces.corners[c]]);
  return true;
}

void MeshBuilder::add_triangle(const FaceList& faces, const Look& look,
                               const std::array<std::size_t, 3>& corners, bool is_flipped,
                               const std::vector<std::uint32_t>& vertex_of_point) {
  std::array<std::uint32_t, 3> triangle{};
  std::array<Vector2d, 3> uv{Vector2d::Zero(), Vector2d::Zero(), Vector2d::Zero()};
  std::array<float, 3> luminance{};
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t corner = corners[is_flipped ? 2 - i : i];
    triangle[i] = vertex_of_point[faces.corners[corner]];
    if (look.texture >= 0 && !faces.corner_uv.empty()) {
      uv[i] = look.X_uv * faces.corner_uv[corner];
      if (!uv[i].allFinite()) uv[i] = Vector2d::Zero();
    }
    luminance[i] = faces.corner_luminance.empty() ? look.luminance : faces.corner_luminance[corner];
  }
  mesh_.triangles.push_back(triangle);
  mesh_.corner_uv.push_back(uv);
  mesh_.corner_luminance.push_back(luminance);
}

TexturedMesh MeshBuilder::finish(std::vector<std::string>& warnings) {
  if (short_face_count_ > 0)
    warnings.push_back(
        first_short_face_ + ": " + std::to_string(short_face_count_) +
        " faces with fewer than three different corners were dropped (this is the first place)");
  if (infinite_face_count_ > 0)
    warnings.push_back(std::to_string(infinite_face_count_) +
                       " faces with coordinates out of range were dropped");
  if (cutter_.given_up() > 0)
    warnings.push_back(std::to_string(cutter_.given_up()) + " huge concave faces were cut into fans");
  return std::move(mesh_);
}

}  // namespace hilbrush
