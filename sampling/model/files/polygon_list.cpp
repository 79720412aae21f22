#include "sampling/model/files/polygon_list.h"

#include <algorithm>

#include "sampling/base/input_error.h"

namespace hilbrush {

void PolygonList::check_room(std::size_t corner_count, const std::string& at,
                             const ModelLimits& limits) const {
  constexpr std::size_t kCornersPerTriangle = 8;
  if (face_ends.size() >= limits.triangles ||
      corners.size() + corner_count > kCornersPerTriangle * limits.triangles)
    throw InputError(at, "the model has more faces than the limit of " + std::to_string(limits.triangles));
}

FaceList PolygonList::take_faces(const std::string& at, std::size_t& dropped) {
  FaceList faces;
  faces.at = at;
  const bool has_colors = !point_luminance.empty() || !face_luminance.empty();
  const auto luminance_at = [&](std::uint32_t v, std::size_t f) {
    if (!point_luminance.empty()) return point_luminance[v];
    return f < face_luminance.size() ? face_luminance[f] : 1.f;
  };
  for (std::size_t f = 0, begin = 0; f < face_ends.size(); begin = face_ends[f++]) {
    const auto first = corners.begin() + static_cast<std::ptrdiff_t>(begin);
    const auto last = corners.begin() + static_cast<std::ptrdiff_t>(face_ends[f]);
    if (std::any_of(first, last, [&](std::uint32_t v) { return v >= points.size(); })) {
      ++dropped;
      continue;
    }
    for (std::size_t c = begin; c < face_ends[f]; ++c) {
      const std::uint32_t v = corners[c];
      faces.corners.push_back(v);
      if (has_colors) faces.corner_luminance.push_back(luminance_at(v, f));
      if (!corner_uv.empty())
        faces.corner_uv.push_back(c < corner_uv.size() ? corner_uv[c] : Eigen::Vector2d(0, 0));
      else if (!point_uv.empty())
        faces.corner_uv.push_back(point_uv[v]);
    }
    faces.end_face();
  }
  faces.points = std::move(points);
  return faces;
}

}  // namespace hilbrush
