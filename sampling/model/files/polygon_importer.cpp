#include "sampling/model/files/polygon_importer.h"

#include <algorithm>

#include "sampling/base/input_error.h"

namespace hilbrush {
namespace {

/// The entry of a handle in a list that is made long enough for `count` when first used; null if the handle is not one
/// of the first `count`.
template <class T, class Handle>
T* entry_in(std::vector<T>& list, std::size_t count, Handle handle, const T& empty) {
  if (handle.idx() < 0 || static_cast<std::size_t>(handle.idx()) >= count) return nullptr;
  if (list.size() < count) list.resize(count, empty);
  return &list[static_cast<std::size_t>(handle.idx())];
}

}  // namespace

OpenMesh::VertexHandle PolygonImporter::add_vertex(const OpenMesh::Vec3f& p) {
  return add_vertex(OpenMesh::Vec3d(p[0], p[1], p[2]));
}

OpenMesh::VertexHandle PolygonImporter::add_vertex(const OpenMesh::Vec3d& p) {
  if (points_.size() >= 3 * limits_.triangles)
    throw InputError(name_, "the model has more points than the limit of " + std::to_string(3 * limits_.triangles));
  points_.emplace_back(p[0], p[1], p[2]);
  store_.grow_vertices(points_.size());
  return VertexHandle(static_cast<int>(points_.size()) - 1);
}

void PolygonImporter::set_point(VertexHandle v, const OpenMesh::Vec3f& p) {
  if (v.idx() >= 0 && static_cast<std::size_t>(v.idx()) < points_.size())
    points_[static_cast<std::size_t>(v.idx())] = {p[0], p[1], p[2]};
}

OpenMesh::FaceHandle PolygonImporter::add_face(const VHandles& corners) {
  if (face_ends_.size() >= limits_.triangles || corners_.size() + corners.size() > 8 * limits_.triangles)
    throw InputError(name_, "the model has more faces than the limit of " + std::to_string(limits_.triangles));
  for (const VertexHandle& v : corners) corners_.push_back(static_cast<std::uint32_t>(v.idx()));
  face_ends_.push_back(corners_.size());
  store_.grow_faces(face_ends_.size());
  return FaceHandle(static_cast<int>(face_ends_.size()) - 1);
}

void PolygonImporter::set_face_uv(std::size_t face, const std::vector<float>& numbers) {
  const std::size_t count = corner_count(face);
  if (numbers.size() != 2 * count) return;
  if (corner_uv_.size() < corners_.size()) corner_uv_.resize(corners_.size(), Eigen::Vector2d::Zero());
  const std::size_t first = face_ends_[face] - count;
  for (std::size_t i = 0; i < count; ++i) corner_uv_[first + i] = {numbers[2 * i], numbers[2 * i + 1]};
}

void PolygonImporter::add_face_texcoords(FaceHandle f, VertexHandle, const std::vector<OpenMesh::Vec2f>& uv) {
  if (!f.is_valid() || uv.empty()) return;
  std::vector<float> numbers;
  for (const auto& pair : uv) numbers.insert(numbers.end(), {pair[0], pair[1]});
  set_face_uv(static_cast<std::size_t>(f.idx()), numbers);
}

void PolygonImporter::set_texcoord(VertexHandle v, const OpenMesh::Vec2f& uv) {
  if (auto* entry = entry_in(vertex_uv_, points_.size(), v, Eigen::Vector2d(0, 0))) *entry = {uv[0], uv[1]};
}

void PolygonImporter::set_vertex_color(VertexHandle v, double red, double green, double blue) {
  if (float* entry = entry_in(vertex_luminance_, points_.size(), v, -1.f)) *entry = luminance_of_srgb(red, green, blue);
}

void PolygonImporter::set_face_color(FaceHandle f, double red, double green, double blue) {
  if (float* entry = entry_in(face_luminance_, face_ends_.size(), f, -1.f))
    *entry = luminance_of_srgb(red, green, blue);
}

PolygonImporter::Polygons PolygonImporter::take_polygons(float luminance_otherwise) {
  Polygons polygons;
  FaceList& faces = polygons.faces;
  faces.at = name_;
  const bool has_colors = !vertex_luminance_.empty() || !face_luminance_.empty();
  const auto luminance_at = [&](std::uint32_t v, std::size_t f) {
    const float of_vertex = v < vertex_luminance_.size() ? vertex_luminance_[v] : -1;
    const float of_face = f < face_luminance_.size() ? face_luminance_[f] : -1;
    return of_vertex >= 0 ? of_vertex : of_face >= 0 ? of_face : luminance_otherwise;
  };
  for (std::size_t f = 0, begin = 0; f < face_ends_.size(); begin = face_ends_[f++]) {
    const auto first = corners_.begin() + static_cast<std::ptrdiff_t>(begin);
    const auto last = corners_.begin() + static_cast<std::ptrdiff_t>(face_ends_[f]);
    if (std::any_of(first, last, [&](std::uint32_t v) { return v >= points_.size(); })) {
      ++polygons.dropped;
      continue;
    }
    for (std::size_t c = begin; c < face_ends_[f]; ++c) {
      const std::uint32_t v = corners_[c];
      faces.corners.push_back(v);
      if (has_colors) faces.corner_luminance.push_back(luminance_at(v, f));
      if (!corner_uv_.empty())
        faces.corner_uv.push_back(c < corner_uv_.size() ? corner_uv_[c] : Eigen::Vector2d(0, 0));
      else if (!vertex_uv_.empty())
        faces.corner_uv.push_back(v < vertex_uv_.size() ? vertex_uv_[v] : Eigen::Vector2d(0, 0));
    }
    faces.end_face();
  }
  faces.points = std::move(points_);
  return polygons;
}

}  // namespace hilbrush
