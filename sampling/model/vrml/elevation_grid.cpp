#include "sampling/base/input_error.h"
#include "sampling/model/vrml/surfaces.h"

namespace hilbrush::vrml {
namespace {

std::size_t dimension(const Reference& node, const char* field, std::size_t height_count) {
  const double count = number_of(node, field, 0);
  if (!(count >= 2 && count <= static_cast<double>(height_count)))
    throw InputError(at(*node.node), std::string(field) +
                                         " of ElevationGrid must be from 2 to the number of heights (" +
                                         std::to_string(height_count) + ")");
  return static_cast<std::size_t>(count);
}

}  // namespace

FaceList elevation_grid(const Reference& node, const SurfaceParts& parts, float otherwise,
                        std::vector<std::string>& warnings) {
  const std::vector<double>& height = numbers_of(node, "height");
  const std::size_t columns = dimension(node, "xDimension", height.size());
  const std::size_t rows = dimension(node, "zDimension", height.size());
  // Both are at most as large as a list in memory, so the product does not overflow.
  if (rows * columns > height.size())
    throw InputError(at(*node.node), "ElevationGrid needs " + std::to_string(columns) + " x " + std::to_string(rows) +
                                         " heights, found " + std::to_string(height.size()));
  const double spacing_x = number_of(node, "xSpacing", 1), spacing_z = number_of(node, "zSpacing", 1);
  FaceList faces;
  faces.at = at(*node.node);
  faces.is_reversed = !flag_of(node, "ccw", true);
  for (std::size_t z = 0; z < rows; ++z)
    for (std::size_t x = 0; x < columns; ++x)
      faces.points.emplace_back(spacing_x * static_cast<double>(x), height[z * columns + x],
                                spacing_z * static_cast<double>(z));

  static const std::vector<double> none;
  const std::vector<double>& uv = parts.texture_coordinates ? numbers_of(parts.texture_coordinates, "point") : none;
  const bool has_uv = uv.size() >= 2 * faces.points.size();
  const std::vector<float> colors =
      parts.colors ? luminances_of(numbers_of(parts.colors, "color")) : std::vector<float>();
  const bool is_per_vertex = flag_of(node, "colorPerVertex", true);
  const std::size_t colors_needed = is_per_vertex ? faces.points.size() : (rows - 1) * (columns - 1);
  if (parts.texture_coordinates && !has_uv)
    warnings.push_back(faces.at + ": too few texture coordinates for the ElevationGrid; the default mapping is used");
  if (parts.colors && colors.size() < colors_needed)
    warnings.push_back(faces.at + ": too few colors for the ElevationGrid; the rest get the material's");

  const auto add_corner = [&](std::size_t x, std::size_t z, std::size_t quad) {
    const std::size_t point = z * columns + x;
    faces.corners.push_back(static_cast<std::uint32_t>(point));
    faces.corner_uv.push_back(has_uv ? Eigen::Vector2d(uv[2 * point], uv[2 * point + 1])
                                     : Eigen::Vector2d(static_cast<double>(x) / static_cast<double>(columns - 1),
                                                       static_cast<double>(z) / static_cast<double>(rows - 1)));
    const std::size_t color = is_per_vertex ? point : quad;
    if (parts.colors) faces.corner_luminance.push_back(color < colors.size() ? colors[color] : otherwise);
  };
  // Two triangles a quad, so that where a quad bends does not depend on the view it is cut in.
  for (std::size_t z = 0; z + 1 < rows; ++z)
    for (std::size_t x = 0; x + 1 < columns; ++x) {
      const std::size_t quad = z * (columns - 1) + x;
      add_corner(x, z, quad);
      add_corner(x, z + 1, quad);
      add_corner(x + 1, z + 1, quad);
      faces.end_face();
      add_corner(x, z, quad);
      add_corner(x + 1, z + 1, quad);
      add_corner(x + 1, z, quad);
      faces.end_face();
    }
  return faces;
}

}  // namespace hilbrush::vrml
