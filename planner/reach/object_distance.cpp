#include "planner/reach/object_distance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace hilbrush {
namespace {

/// Grid step, m; larger where the grid would have more nodes than kMaxNodes.
constexpr double kStepM = 2e-3;
constexpr double kMaxNodes = 1.5e6;
constexpr double kMaxSurfacePoints = 3e6;
constexpr std::uint32_t kNoPoint = std::numeric_limits<std::uint32_t>::max();

}  // namespace

ObjectDistance::ObjectDistance(const TexturedMesh& mesh, double range_m) : range_m_(range_m) {
  choose_grid(mesh);
  spread(surface_points(mesh));
}

void ObjectDistance::choose_grid(const TexturedMesh& mesh) {
  const auto [low, high] = bounds(mesh);
  const Eigen::Vector3d extent = high - low + Eigen::Vector3d::Constant(2 * range_m_);
  step_m_ = std::max(kStepM, std::cbrt(extent.prod() / kMaxNodes));
  low_O_ = low - Eigen::Vector3d::Constant(range_m_);
  spacing_m_ = std::max(step_m_ / 2, std::sqrt(2 * mesh.area_m2() / kMaxSurfacePoints));
  size_ = (extent / step_m_).array().ceil().cast<int>() + 1;
}

std::vector<Eigen::Vector3f> ObjectDistance::surface_points(const TexturedMesh& mesh) const {
  const double spacing = spacing_m_;
  std::vector<Eigen::Vector3f> points;
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
    const Eigen::Vector3d& a = mesh.corner(t, 0);
    const Eigen::Vector3d ab = mesh.corner(t, 1) - a;
    const Eigen::Vector3d ac = mesh.corner(t, 2) - a;
    const double longest = std::max({ab.norm(), ac.norm(), (ac - ab).norm()});
    const int n = std::max(1, static_cast<int>(std::ceil(longest / spacing)));
    for (int i = 0; i <= n; ++i)
      for (int j = 0; i + j <= n; ++j)
        points.push_back(
            (a + ab * (static_cast<double>(i) / n) + ac * (static_cast<double>(j) / n)).cast<float>());
  }
  return points;
}

/// Each node takes its nearest point from its neighbors: first those around each point, then by scans in both
/// directions.
void ObjectDistance::spread(const std::vector<Eigen::Vector3f>& points) {
  const std::size_t node_count = index(0, 0, size_.z());
  std::vector<std::uint32_t> nearest(node_count, kNoPoint);
  std::vector<float> distance2(node_count, std::numeric_limits<float>::max());
  const Eigen::Vector3f low = low_O_.cast<float>();
  const float step = static_cast<float>(step_m_);

  const auto offer = [&](int x, int y, int z, std::uint32_t point) {
    const Eigen::Vector3f node =
        low + step * Eigen::Vector3f(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
    const float d2 = (points[point] - node).squaredNorm();
    const std::size_t i = index(x, y, z);
    if (d2 >= distance2[i]) return;
    distance2[i] = d2;
    nearest[i] = point;
  };
  for (std::uint32_t k = 0; k < points.size(); ++k) {
    const Eigen::Vector3i corner =
        ((points[k] - low) / step).array().floor().cast<int>().max(0).min(size_.array() - 2);
    for (int c = 0; c < 8; ++c)
      offer(corner.x() + (c & 1), corner.y() + (c >> 1 & 1), corner.z() + (c >> 2), k);
  }

  // Each slab takes points from the one before it, then passes them on within itself: rows and columns, each
  // in both directions.
  const auto take_from = [&](int x, int y, int z, const std::array<int, 3>& step_to) {
    const int nx = x + step_to[0];
    const int ny = y + step_to[1];
    const int nz = z + step_to[2];
    if (nx < 0 || ny < 0 || nz < 0 || nx >= size_.x() || ny >= size_.y() || nz >= size_.z()) return;
    const std::uint32_t point = nearest[index(nx, ny, nz)];
    if (point != kNoPoint && point != nearest[index(x, y, z)]) offer(x, y, z, point);
  };
  const auto scan_row = [&](int y, int z, int dy) {
    for (int x = 0; x < size_.x(); ++x) {
      for (int dx = -1; dx <= 1; ++dx) take_from(x, y, z, {dx, dy, 0});
      take_from(x, y, z, {-1, 0, 0});
    }
    for (int x = size_.x() - 1; x >= 0; --x) take_from(x, y, z, {1, 0, 0});
  };
  const auto scan_slab = [&](int z, int dz) {
    for (int y = 0; y < size_.y(); ++y)
      for (int x = 0; x < size_.x(); ++x)
        for (int n = 0; n < 9; ++n) take_from(x, y, z, {n % 3 - 1, n / 3 - 1, dz});
    for (int y = 0; y < size_.y(); ++y) scan_row(y, z, -1);
    for (int y = size_.y() - 1; y >= 0; --y) scan_row(y, z, 1);
  };
  for (int z = 0; z < size_.z(); ++z) scan_slab(z, -1);
  for (int z = size_.z() - 1; z >= 0; --z) scan_slab(z, 1);
  distance_m_.resize(node_count);
  std::transform(distance2.begin(), distance2.end(), distance_m_.begin(),
                 [range = static_cast<float>(range_m_)](float d2) { return std::min(range, std::sqrt(d2)); });
}

double ObjectDistance::operator()(const Eigen::Vector3d& p_O) const {
  const Eigen::Array3d at = (p_O - low_O_).array() / step_m_;
  if (!((at >= 0).all() && (at < (size_.array() - 1).cast<double>()).all())) return range_m_;
  const Eigen::Array3i node = at.cast<int>();
  const Eigen::Array3d f = at - node.cast<double>();
  const std::size_t row = static_cast<std::size_t>(size_.x());
  const std::size_t slab = row * static_cast<std::size_t>(size_.y());
  const float* d = &distance_m_[index(node.x(), node.y(), node.z())];
  const auto along_x = [&](const float* p) { return p[0] + f.x() * (p[1] - p[0]); };
  const auto along_y = [&](const float* p) {
    const double near = along_x(p);
    return near + f.y() * (along_x(p + row) - near);
  };
  const double near = along_y(d);
  return near + f.z() * (along_y(d + slab) - near);
}

}  // namespace hilbrush
