#include "sim/film/orthographic_view.h"

#include <algorithm>
#include <cmath>

namespace hilbrush {

/// Barycentric coordinates of (x, y) in a projected triangle: value_k = constant_k + x dx_k + y dy_k. None
/// for a triangle seen edge-on.
struct OrthographicView::PlaneCoordinates {
  Eigen::Vector3d constant, dx, dy;
  bool is_valid = false;

  PlaneCoordinates(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
    const double area = (b.x() - a.x()) * (c.y() - a.y()) - (c.x() - a.x()) * (b.y() - a.y());
    is_valid = std::abs(area) > 1e-12;
    if (!is_valid) return;
    dx = Eigen::Vector3d(b.y() - c.y(), c.y() - a.y(), a.y() - b.y()) / area;
    dy = Eigen::Vector3d(c.x() - b.x(), a.x() - c.x(), b.x() - a.x()) / area;
    constant = Eigen::Vector3d(b.x() * c.y() - c.x() * b.y(), c.x() * a.y() - a.x() * c.y(),
                               a.x() * b.y() - b.x() * a.y()) /
               area;
  }
  Eigen::Vector3d at(double x, double y) const { return constant + x * dx + y * dy; }
};

OrthographicView::OrthographicView(const TexturedMesh& mesh, const ViewDirection& direction, double pixel_m,
                                   int margin)
    : mesh_(mesh),
      right_O_(direction.right_O()),
      up_O_(direction.up_O),
      forward_O_(direction.forward_O),
      pixel_m_(pixel_m) {
  constexpr double kForever = std::numeric_limits<double>::infinity();
  Eigen::Vector2d low = Eigen::Vector2d::Constant(kForever);
  Eigen::Vector2d high = -low;
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t vertex : triangle) {
      const Eigen::Vector2d place(right_O_.dot(mesh.vertices[vertex]), up_O_.dot(mesh.vertices[vertex]));
      low = low.cwiseMin(place), high = high.cwiseMax(place);
    }
  if (mesh.triangles.empty()) low = high = Eigen::Vector2d::Zero();
  width_ = static_cast<int>(std::ceil((high.x() - low.x()) / pixel_m)) + 1 + 2 * margin;
  height_ = static_cast<int>(std::ceil((high.y() - low.y()) / pixel_m)) + 1 + 2 * margin;
  left_m_ = .5 * (low.x() + high.x() - width_ * pixel_m);
  top_m_ = .5 * (low.y() + high.y() + height_ * pixel_m);
  triangles_.assign(static_cast<std::size_t>(width_) * height_, kNothing);
  depths_m_.assign(triangles_.size(), std::numeric_limits<float>::infinity());
  for (std::uint32_t t = 0; t < mesh.triangle_count(); ++t) fill(t);
}

Eigen::Vector3d OrthographicView::project(const Eigen::Vector3d& p_O) const {
  return {(right_O_.dot(p_O) - left_m_) / pixel_m_, (top_m_ - up_O_.dot(p_O)) / pixel_m_,
          forward_O_.dot(p_O)};
}

void OrthographicView::fill(std::uint32_t triangle) {
  const Eigen::Vector3d a = project(mesh_.corner(triangle, 0));
  const Eigen::Vector3d b = project(mesh_.corner(triangle, 1));
  const Eigen::Vector3d c = project(mesh_.corner(triangle, 2));
  const PlaneCoordinates coordinates(a, b, c);
  if (!coordinates.is_valid) return;
  const Eigen::Vector3d depths(a.z(), b.z(), c.z());
  const double x_min = std::min({a.x(), b.x(), c.x()});
  const double x_max = std::max({a.x(), b.x(), c.x()});
  const int first_row = std::max(0, static_cast<int>(std::ceil(std::min({a.y(), b.y(), c.y()}) - .5)));
  const int last_row =
      std::min(height_ - 1, static_cast<int>(std::floor(std::max({a.y(), b.y(), c.y()}) - .5)));
  // Along an outline a front and a back face meet at equal depth: the front, which has the film, is shown.
  const double behind_m = mesh_.area_vector(triangle).dot(forward_O_) < 0 ? 0 : .05 * pixel_m_;
  constexpr double kRounding = 1e-9;  // neighbors share their border's pixels rather than leave gaps
  for (int row = first_row; row <= last_row; ++row) {
    const Eigen::Vector3d at_left = coordinates.constant + (row + .5) * coordinates.dy;
    double low = x_min;
    double high = x_max;
    for (int k = 0; k < 3; ++k) {
      const double slope = coordinates.dx[k];
      const double border = -(at_left[k] + kRounding) / slope;
      if (slope > 0)
        low = std::max(low, border);
      else if (slope < 0)
        high = std::min(high, border);
      else if (at_left[k] < -kRounding)
        high = low - 1;
    }
    const int first = std::max(0, static_cast<int>(std::ceil(low - .5)));
    const int last = std::min(width_ - 1, static_cast<int>(std::floor(high - .5)));
    const double depth_start = depths.dot(at_left) + behind_m;
    const double depth_step = depths.dot(coordinates.dx);
    for (int x = first; x <= last; ++x) {
      const auto depth = static_cast<float>(depth_start + (x + .5) * depth_step);
      const std::size_t pixel = static_cast<std::size_t>(row) * width_ + x;
      if (depth >= depths_m_[pixel]) continue;
      depths_m_[pixel] = depth;
      triangles_[pixel] = triangle;
    }
  }
}

OrthographicView::PlaneCoordinates OrthographicView::coordinates_of(std::uint32_t triangle) const {
  return {project(mesh_.corner(triangle, 0)), project(mesh_.corner(triangle, 1)),
          project(mesh_.corner(triangle, 2))};
}

OrthographicView::Pixel OrthographicView::pixel(int x, int y) const {
  const std::uint32_t triangle = triangle_at(x, y);
  if (triangle == kNothing) return {};
  return pixel_on(triangle, coordinates_of(triangle), x, y);
}

OrthographicView::Pixel OrthographicView::pixel_on(std::uint32_t triangle,
                                                   const PlaneCoordinates& coordinates, int x, int y) const {
  const Side side = mesh_.area_vector(triangle).dot(forward_O_) < 0 ? Side::kFront : Side::kBack;
  const Eigen::Vector3d inside = coordinates.at(x + .5, y + .5).cwiseMax(0.);
  return {side, {triangle, inside / inside.sum()}};
}

void OrthographicView::read_row(int y, std::vector<Pixel>& pixels) const {
  pixels.assign(width_, {});
  for (int x = 0; x < width_;) {
    const std::uint32_t triangle = triangle_at(x, y);
    if (triangle == kNothing) {
      ++x;
      continue;
    }
    const PlaneCoordinates coordinates = coordinates_of(triangle);
    for (; x < width_ && triangle_at(x, y) == triangle; ++x)
      pixels[x] = pixel_on(triangle, coordinates, x, y);
  }
}

std::optional<Eigen::Vector2i> OrthographicView::pixel_of(const Eigen::Vector3d& p_O,
                                                          double tolerance_m) const {
  const Eigen::Vector3d place = project(p_O);
  const Eigen::Vector2i pixel(static_cast<int>(std::floor(place.x())),
                              static_cast<int>(std::floor(place.y())));
  if (pixel.x() < 0 || pixel.y() < 0 || pixel.x() >= width_ || pixel.y() >= height_) return std::nullopt;
  const float depth_m = depths_m_[static_cast<std::size_t>(pixel.y()) * width_ + pixel.x()];
  if (depth_m < place.z() - tolerance_m) return std::nullopt;
  return pixel;
}

}  // namespace hilbrush
