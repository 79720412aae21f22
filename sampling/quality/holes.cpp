#include "sampling/quality/holes.h"

#include <numbers>

#include "sampling/base/check.h"
#include "sampling/quality/point_tree.h"
#include "sampling/quality/quality.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d, Eigen::Vector3d;

const auto kAnyPoint = [](std::uint32_t) { return true; };

/// An octahedron whose faces are divided into four `times` times, with all new corners on the unit sphere.
std::vector<SearchTriangle> sphere_triangles(int times) {
  std::vector<SearchTriangle> triangles;
  for (const double x : {-1., 1.})
    for (const double y : {-1., 1.})
      for (const double z : {-1., 1.})
        triangles.push_back({{Vector3d(x, 0, 0), Vector3d(0, y, 0), Vector3d(0, 0, z)}, 0});
  for (int i = 0; i < times; ++i) {
    std::vector<SearchTriangle> finer;
    for (const SearchTriangle& t : triangles) {
      std::array<Vector3d, 3> middles;
      for (std::size_t k = 0; k < 3; ++k) middles[k] = (t.corners[k] + t.corners[(k + 1) % 3]).normalized();
      for (std::size_t k = 0; k < 3; ++k)
        finer.push_back({{t.corners[k], middles[k], middles[(k + 2) % 3]}, 0});
      finer.push_back({middles, 0});
    }
    triangles = std::move(finer);
  }
  return triangles;
}

}  // namespace

double plane_largest_hole(std::span<const Vector2d> points) {
  CHECK(!points.empty());
  const PointTree<2> tree(points);
  const Vector3d o(0, 0, 0), x(1, 0, 0), y(0, 1, 0), xy(1, 1, 0);
  const double radius =
      largest_distance({{{o, x, xy}, 0}, {{o, xy, y}, 0}}, [&tree](const Vector3d& place, std::uint32_t) {
        return tree.nearest(place.head<2>(), kAnyPoint).distance;
      });
  return radius * std::sqrt(static_cast<double>(points.size()));
}

double sphere_largest_hole(std::span<const Vector3d> directions) {
  CHECK(!directions.empty());
  const PointTree<3> tree(directions);
  std::vector<SearchTriangle> triangles = sphere_triangles(3);
  // Lifting the flat triangles onto the sphere stretches distances by at most this.
  double innermost = 1;
  for (const SearchTriangle& t : triangles) innermost = std::min(innermost, t.middle().norm());
  const double stretch = 1 / (innermost * innermost);
  const double chord =
      stretch *
      largest_distance(std::move(triangles), [&tree, stretch](const Vector3d& place, std::uint32_t) {
        return tree.nearest(place.normalized(), kAnyPoint).distance / stretch;
      });
  return chord * std::sqrt(static_cast<double>(directions.size()) / (4 * std::numbers::pi));
}

}  // namespace hilbrush
