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

const std::vector<double>& numbers_or_none(const Reference& reference, const char* field) {
  static const std::vector<double> none;
  return reference ? numbers_of(reference, field) : none;
}

/// How many heights there are along x and z, and how far apart.
struct Grid {
  std::size_t columns;
  std::size_t rows;
  double spacing_x;
  double spacing_z;
};

Grid read_grid(const Reference& node, const std::vector<double>& height) {
  Grid grid{};
  grid.columns = dimension(node, "xDimension", height.size());
  grid.rows = dimension(node, "zDimension", height.size());
  // Both are at most as large as a list in memory, so the product does not overflow.
  if (grid.rows * grid.columns > height.size())
    throw InputError(at(*node.node), "ElevationGrid needs " + std::to_string(grid.columns) + " x " +
                                         std::to_string(grid.rows) + " heights, found " +
                                         std::to_string(height.size()));
  grid.spacing_x = number_of(node, "xSpacing", 1);
  grid.spacing_z = number_of(node, "zSpacing", 1);
  return grid;
}

/// What the corners of the grid's triangles are given: texture coordinates, and colors of vertices or quads.
class Corners {
 public:
  Corners(const Reference& node, const SurfaceParts& parts, const Grid& grid, float otherwise,
          std::vector<std::string>& warnings)
      : grid_(grid),
        uv_(numbers_or_none(parts.texture_coordinates, "point")),
        colors_(parts.colors ? luminances_of(numbers_of(parts.colors, "color")) : std::vector<float>()),
        has_colors_(parts.colors),
        is_per_vertex_(flag_of(node, "colorPerVertex", true)),
        otherwise_(otherwise) {
    const std::size_t points = grid.rows * grid.columns;
    has_uv_ = uv_.size() >= 2 * points;
    const std::size_t colors_needed = is_per_vertex_ ? points : (grid.rows - 1) * (grid.columns - 1);
    if (parts.texture_coordinates && !has_uv_)
      warnings.push_back(at(*node.node) +
                         ": too few texture coordinates for the ElevationGrid; the default mapping is used");
    if (has_colors_ && colors_.size() < colors_needed)
      warnings.push_back(at(*node.node) +
                         ": too few colors for the ElevationGrid; the rest get the material's");
  }

  void add(FaceList& faces, std::size_t x, std::size_t z, std::size_t quad) const {
    const std::size_t point = z * grid_.columns + x;
    faces.corners.push_back(static_cast<std::uint32_t>(point));
    faces.corner_uv.push_back(
        has_uv_ ? Eigen::Vector2d(uv_[2 * point], uv_[2 * point + 1])
                : Eigen::Vector2d(static_cast<double>(x) / static_cast<double>(grid_.columns - 1),
                                  static_cast<double>(z) / static_cast<double>(grid_.rows - 1)));
    const std::size_t color = is_per_vertex_ ? point : quad;
    if (has_colors_) faces.corner_luminance.push_back(color < colors_.size() ? colors_[color] : otherwise_);
  }

 private:
  const Grid& grid_;
  const std::vector<double>& uv_;
  std::vector<float> colors_;
  bool has_uv_ = false;
  bool has_colors_;
  bool is_per_vertex_;
  float otherwise_;
};

}  // namespace

FaceList elevation_grid(const Reference& node, const SurfaceParts& parts, float otherwise,
                        std::vector<std::string>& warnings) {
  const std::vector<double>& height = numbers_of(node, "height");
  const Grid grid = read_grid(node, height);
  FaceList faces;
  faces.at = at(*node.node);
  faces.is_reversed = !flag_of(node, "ccw", true);
  for (std::size_t z = 0; z < grid.rows; ++z)
    for (std::size_t x = 0; x < grid.columns; ++x)
      faces.points.emplace_back(grid.spacing_x * static_cast<double>(x), height[z * grid.columns + x],
                                grid.spacing_z * static_cast<double>(z));

  const Corners corners(node, parts, grid, otherwise, warnings);
  // Two triangles a quad, so that where a quad bends does not depend on the direction it is cut in.
  for (std::size_t z = 0; z + 1 < grid.rows; ++z)
    for (std::size_t x = 0; x + 1 < grid.columns; ++x) {
      const std::size_t quad = z * (grid.columns - 1) + x;
      corners.add(faces, x, z, quad);
      corners.add(faces, x, z + 1, quad);
      corners.add(faces, x + 1, z + 1, quad);
      faces.end_face();
      corners.add(faces, x, z, quad);
      corners.add(faces, x + 1, z + 1, quad);
      corners.add(faces, x + 1, z, quad);
      faces.end_face();
    }
  return faces;
}

}  // namespace hilbrush::vrml
