#include "sampling/tone/asked_atlas.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "sampling/base/check.h"

namespace hilbrush {
namespace {

/// Nodes on a length: both ends, and as many between as keep them `spacing` apart.
int nodes_over(double length_m, double spacing_m) {
  return 1 + static_cast<int>(std::clamp(std::ceil(length_m / spacing_m - 1e-9), 1., 1e6));
}

}  // namespace

AtlasLayout::AtlasLayout(const TexturedMesh& mesh, double spacing_m, double texel_limit)
    : mesh_(mesh), rectangles_(mesh.triangle_count()) {
  CHECK(spacing_m > 0);
  std::vector<Eigen::Vector2d> sizes_m(rectangles_.size());
  for (std::uint32_t t = 0; t < sizes_m.size(); ++t) {
    const TriangleFrame frame(mesh, t);
    sizes_m[t] = {frame.length_m(), frame.height_m()};
  }
  // Four texels a triangle is the least; what is above the limit beyond that can be had by a wider spacing.
  const double limit = std::max(texel_limit, 8. * static_cast<double>(sizes_m.size()));
  for (double total = 2 * limit; total > limit; spacing_m *= 1.25) {
    total = 0;
    for (std::size_t t = 0; t < sizes_m.size(); ++t) {
      rectangles_[t].columns = nodes_over(sizes_m[t].x(), spacing_m);
      rectangles_[t].rows = nodes_over(sizes_m[t].y(), spacing_m);
      total += static_cast<double>(rectangles_[t].columns) * rectangles_[t].rows;
    }
  }
  pack();
}

/// On shelves, the highest rectangles first, which leaves little between them.
void AtlasLayout::pack() {
  std::vector<std::uint32_t> order(rectangles_.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return rectangles_[a].rows > rectangles_[b].rows;
  });
  double area = 0;
  int widest = 1;
  for (const Rectangle& r : rectangles_) {
    area += static_cast<double>(r.columns) * r.rows;
    widest = std::max(widest, r.columns);
  }
  width_ = std::max(widest, static_cast<int>(std::ceil(std::sqrt(area))));
  int x = 0, shelf = 0;
  for (const std::uint32_t t : order) {
    Rectangle& r = rectangles_[t];
    if (x + r.columns > width_) x = 0, shelf = height_;
    r.x = x, r.y = shelf;
    x += r.columns;
    height_ = std::max(height_, shelf + r.rows);
  }
}

Eigen::Vector2d AtlasLayout::step_m(const TriangleFrame& frame, std::uint32_t triangle) const {
  const Rectangle& r = rectangles_[triangle];
  return {frame.length_m() / (r.columns - 1), frame.height_m() / (r.rows - 1)};
}

std::array<Eigen::Vector2d, 3> AtlasLayout::texel_corners(std::uint32_t triangle) const {
  const TriangleFrame frame(mesh_, triangle);
  const Rectangle& r = rectangles_[triangle];
  const Eigen::Vector2d step = step_m(frame, triangle);
  std::array<Eigen::Vector2d, 3> corners = frame.corners();
  for (Eigen::Vector2d& corner : corners) {
    corner = {step.x() > 0 ? corner.x() / step.x() : 0, step.y() > 0 ? corner.y() / step.y() : 0};
    corner += Eigen::Vector2d(r.x, r.y);
  }
  return corners;
}

}  // namespace hilbrush
