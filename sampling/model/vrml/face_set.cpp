#include <cmath>

#include "sampling/model/vrml/surfaces.h"

namespace hilbrush::vrml {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// The list's item at an index that came from a file, or null.
template <class T>
const T* item_at(const std::vector<T>& list, double index) {
  return index >= 0 && index < static_cast<double>(list.size()) ? &list[static_cast<std::size_t>(index)]
                                                                : nullptr;
}

std::vector<Vector2d> pairs_of(const std::vector<double>& numbers) {
  std::vector<Vector2d> pairs(numbers.size() / 2);
  for (std::size_t i = 0; i < pairs.size(); ++i) pairs[i] = {numbers[2 * i], numbers[2 * i + 1]};
  return pairs;
}

/// Which entry of the coordIndex list each corner is, and which of its faces each face.
struct Outlines {
  std::vector<std::size_t> entry_of_corner;
  std::vector<std::size_t> number_of_face;
  std::size_t dropped = 0;
};

Outlines read_outlines(const std::vector<double>& coord_index, FaceList& faces) {
  Outlines outlines;
  std::size_t face_number = 0;
  std::size_t begin = 0;
  bool is_good = true;
  const auto end_face = [&](std::size_t entry) {
    if (entry == begin) return;  // two ends in a row
    if (is_good) {
      for (std::size_t p = begin; p < entry; ++p) {
        faces.corners.push_back(static_cast<std::uint32_t>(coord_index[p]));
        outlines.entry_of_corner.push_back(p);
      }
      faces.end_face();
      outlines.number_of_face.push_back(face_number);
    } else {
      ++outlines.dropped;
    }
    ++face_number;
  };
  for (std::size_t entry = 0; entry < coord_index.size(); ++entry) {
    if (coord_index[entry] < 0) {
      end_face(entry);
      begin = entry + 1;
      is_good = true;
    } else if (!item_at(faces.points, coord_index[entry])) {
      is_good = false;
    }
  }
  end_face(coord_index.size());  // the last -1 may be missing
  return outlines;
}

void read_texture_coordinates(const Reference& node, const Reference& texture_coordinates,
                              const Outlines& outlines, FaceList& faces, std::vector<std::string>& warnings) {
  const std::vector<Vector2d> points = pairs_of(numbers_of(texture_coordinates, "point"));
  if (points.empty()) return;  // as exporters write what they do not use
  const CornerIndices index(numbers_of(node, "texCoordIndex"), numbers_of(node, "coordIndex"));
  std::size_t missing = 0;
  for (const std::size_t entry : outlines.entry_of_corner) {
    const Vector2d* uv = item_at(points, index[entry]);
    missing += uv == nullptr;
    faces.corner_uv.push_back(uv ? *uv : Vector2d(0, 0));
  }
  if (missing == 0) return;
  const bool is_useless = 2 * missing > faces.corner_uv.size();
  if (is_useless) faces.corner_uv.clear();
  warnings.push_back(faces.at + ": " + std::to_string(missing) + " of " +
                     std::to_string(faces.corners.size()) +
                     " corners name texture coordinates that do not exist; " +
                     (is_useless ? "the default mapping is used" : "they get 0 0"));
}

void read_colors(const Reference& node, const Reference& colors, const Outlines& outlines, float otherwise,
                 FaceList& faces, std::vector<std::string>& warnings) {
  const std::vector<float> luminances = luminances_of(numbers_of(colors, "color"));
  if (luminances.empty()) return;
  const std::vector<double>& color_index = numbers_of(node, "colorIndex");
  std::size_t missing = 0;
  const auto add = [&](const float* luminance) {
    missing += luminance == nullptr;
    faces.corner_luminance.push_back(luminance ? *luminance : otherwise);
  };
  if (flag_of(node, "colorPerVertex", true)) {
    const CornerIndices index(color_index, numbers_of(node, "coordIndex"));
    for (const std::size_t entry : outlines.entry_of_corner) add(item_at(luminances, index[entry]));
  } else {
    std::vector<double> face_colors;  // some exporters end each entry with -1, as coordIndex does
    for (const double i : color_index)
      if (i >= 0) face_colors.push_back(i);
    std::size_t corner = 0;
    for (std::size_t f = 0; f < faces.face_ends.size(); ++f) {
      const auto number = static_cast<double>(outlines.number_of_face[f]);
      const double* named = color_index.empty() ? &number : item_at(face_colors, number);
      for (; corner < faces.face_ends[f]; ++corner) add(named ? item_at(luminances, *named) : nullptr);
    }
  }
  if (missing > 0)
    warnings.push_back(faces.at + ": " + std::to_string(missing) + " of " +
                       std::to_string(faces.corners.size()) +
                       " corners name colors that do not exist; they get the material's");
}

}  // namespace

std::vector<Vector3d> points_of(const std::vector<double>& numbers) {
  std::vector<Vector3d> points(numbers.size() / 3);
  for (std::size_t i = 0; i < points.size(); ++i)
    points[i] = {numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]};
  return points;
}

std::vector<float> luminances_of(const std::vector<double>& numbers) {
  std::vector<float> luminances(numbers.size() / 3);
  for (std::size_t i = 0; i < luminances.size(); ++i)
    luminances[i] = luminance_of_srgb(numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]);
  return luminances;
}

FaceList indexed_face_set(const Reference& node, const SurfaceParts& parts, float otherwise,
                          std::vector<std::string>& warnings) {
  FaceList faces;
  faces.at = at(*node.node);
  faces.is_reversed = !flag_of(node, "ccw", true);
  faces.maps_bounding_box = true;
  if (parts.coordinates) faces.points = points_of(numbers_of(parts.coordinates, "point"));
  const Outlines outlines = read_outlines(numbers_of(node, "coordIndex"), faces);
  if (outlines.dropped > 0)
    warnings.push_back(faces.at + ": " + std::to_string(outlines.dropped) +
                       " faces were dropped: they name points that do not exist (there are " +
                       std::to_string(faces.points.size()) + ")");
  if (parts.texture_coordinates)
    read_texture_coordinates(node, parts.texture_coordinates, outlines, faces, warnings);
  if (parts.colors) read_colors(node, parts.colors, outlines, otherwise, faces, warnings);
  return faces;
}

}  // namespace hilbrush::vrml
