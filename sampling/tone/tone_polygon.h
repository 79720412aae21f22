#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "sampling/tone/triangle_tone.h"

/// Small parts of ToneField: bilinear look-up of a computed texel, and integrals of a linear tone over a
/// convex polygon.
namespace hilbrush {

/// No piece of a triangle that sampling makes has more corners.
inline constexpr std::size_t kMaxPolygonCorners = 24;

/// Bilinear look-up of texel_value(index) in a picture of which only the four texels around the point are
/// computed.
template <class TexelValue>
double look_up(int width, int height, const Eigen::Vector2d& point, TexelAddressing addressing,
               TexelValue texel_value) {
  constexpr double kFar = 1e15;  // no texture has a texel beyond, and no index overflows
  const double u = std::clamp(point.x(), -kFar, kFar), v = std::clamp(point.y(), -kFar, kFar);
  const std::int64_t x = floor_index(u), y = floor_index(v);
  const double s = u - static_cast<double>(x), t = v - static_cast<double>(y);
  double sum = 0;
  for (int dy = 0; dy < 2; ++dy)
    for (int dx = 0; dx < 2; ++dx) {
      const double weight = (dx ? s : 1 - s) * (dy ? t : 1 - t);
      if (weight == 0) continue;
      const std::int64_t row = texel_index(y + dy, height, addressing.repeat_y);
      sum += weight * texel_value(static_cast<std::size_t>(row * width +
                                                           texel_index(x + dx, width, addressing.repeat_x)));
    }
  return sum;
}

/// Integrals over a convex polygon of a tone that is linear on it; `scale` is the area of one unit square of
/// the polygon's plane.
template <class Tone>
ToneIntegral integrate_linear(std::span<const Eigen::Vector2d> polygon, Tone tone, double scale) {
  ToneIntegral sum;
  if (polygon.size() < 3) return sum;
  const double f0 = tone(polygon[0]);
  double f1 = tone(polygon[1]);
  for (std::size_t i = 2; i < polygon.size(); ++i) {
    const Eigen::Vector2d a = polygon[i - 1] - polygon[0], b = polygon[i] - polygon[0];
    const double area = .5 * scale * (a.x() * b.y() - a.y() * b.x());
    const double f2 = tone(polygon[i]);
    const double total = f0 + f1 + f2;
    sum.area_m2 += area;
    sum.mass += area * total / 3;
    const Eigen::Vector2d corners = polygon[0] + polygon[i - 1] + polygon[i];
    sum.first += area / 12 * (total * corners + f0 * polygon[0] + f1 * polygon[i - 1] + f2 * polygon[i]);
    sum.square += area / 12 * (total * total + f0 * f0 + f1 * f1 + f2 * f2);
    f1 = f2;
  }
  if (sum.area_m2 < 0) sum = {-sum.area_m2, -sum.mass, -sum.first, -sum.square};
  return sum;
}

/// Integrals over a convex polygon of a tone that is the same everywhere; `scale` as above.
inline ToneIntegral integrate_constant(std::span<const Eigen::Vector2d> polygon, double tone, double scale) {
  ToneIntegral sum;
  double twice_area = 0;
  Eigen::Vector2d first = Eigen::Vector2d::Zero();
  for (std::size_t i = 2; i < polygon.size(); ++i) {
    const Eigen::Vector2d a = polygon[i - 1] - polygon[0], b = polygon[i] - polygon[0];
    const double twice = a.x() * b.y() - a.y() * b.x();
    twice_area += twice;
    first += twice / 3 * (a + b);
  }
  if (twice_area == 0) return sum;
  sum.area_m2 = .5 * scale * std::abs(twice_area);
  sum.mass = tone * sum.area_m2;
  sum.first = sum.mass * (polygon[0] + first / twice_area);
  sum.square = tone * sum.mass;
  return sum;
}

/// Cuts a convex polygon along the lines where the linear function `value` takes the given levels, and hands
/// on each part.
template <class Value, class Visit>
void split_at_levels(std::span<const Eigen::Vector2d> polygon, Value value, std::vector<double> levels,
                     Visit visit) {
  std::sort(levels.begin(), levels.end());
  std::vector<Eigen::Vector2d> rest(polygon.begin(), polygon.end()), below, above;
  for (const double level : levels) {
    below.clear();
    above.clear();
    for (std::size_t i = 0; i < rest.size(); ++i) {
      const Eigen::Vector2d& p = rest[i];
      const Eigen::Vector2d& q = rest[(i + 1) % rest.size()];
      const double vp = value(p) - level, vq = value(q) - level;
      (vp < 0 ? below : above).push_back(p);
      if ((vp < 0) != (vq < 0)) {
        const Eigen::Vector2d crossing = p + vp / (vp - vq) * (q - p);
        below.push_back(crossing);
        above.push_back(crossing);
      }
    }
    if (below.size() >= 3) visit(std::span<const Eigen::Vector2d>(below));
    std::swap(rest, above);
  }
  if (rest.size() >= 3) visit(std::span<const Eigen::Vector2d>(rest));
}

}  // namespace hilbrush
