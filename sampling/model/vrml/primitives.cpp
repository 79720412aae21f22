#include "sampling/model/vrml/primitives.h"

#include <cmath>
#include <numbers>

namespace hilbrush::vrml {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// On a circle about y, at the fraction s of a turn that starts at the back (-z) and runs counter-clockwise
/// seen from above.
Vector3d on_circle(double s, double radius, double y) {
  const double angle = 2 * std::numbers::pi * s;
  return {-radius * std::sin(angle), y, -radius * std::cos(angle)};
}

double fraction(int i) {
  return static_cast<double>(i) / kSegments;
}

void add_corner(FaceList& faces, std::uint32_t point, const Vector2d& uv) {
  faces.corners.push_back(point);
  faces.corner_uv.push_back(uv);
}

/// A ring of kSegments points; returns the index of the first.
std::uint32_t add_ring(FaceList& faces, double radius, double y) {
  const auto first = static_cast<std::uint32_t>(faces.points.size());
  for (int i = 0; i < kSegments; ++i) faces.points.push_back(on_circle(fraction(i), radius, y));
  return first;
}

std::uint32_t on_ring(std::uint32_t first, int i) {
  return first + static_cast<std::uint32_t>(i % kSegments);
}

/// The band between a lower and an upper ring.
void add_band(FaceList& faces, std::uint32_t lower, std::uint32_t upper, double v_lower, double v_upper) {
  for (int i = 0; i < kSegments; ++i) {
    add_corner(faces, on_ring(lower, i), {fraction(i), v_lower});
    add_corner(faces, on_ring(lower, i + 1), {fraction(i + 1), v_lower});
    add_corner(faces, on_ring(upper, i + 1), {fraction(i + 1), v_upper});
    add_corner(faces, on_ring(upper, i), {fraction(i), v_upper});
    faces.end_face();
  }
}

/// Triangles from a ring to one point above (or below) it.
void add_fan(FaceList& faces, std::uint32_t ring, std::uint32_t tip, bool is_tip_above, double v_ring,
             double v_tip) {
  for (int i = 0; i < kSegments; ++i) {
    const int from = is_tip_above ? i : i + 1;
    const int to = is_tip_above ? i + 1 : i;
    add_corner(faces, on_ring(ring, from), {fraction(from), v_ring});
    add_corner(faces, on_ring(ring, to), {fraction(to), v_ring});
    add_corner(faces, tip, {fraction(i) + .5 / kSegments, v_tip});
    faces.end_face();
  }
}

/// A disc on a ring, showing the circle cut out of the texture's middle, upright when tipped towards +z (a
/// top) or -z (a bottom).
void add_disc(FaceList& faces, std::uint32_t ring, double radius, bool is_top) {
  for (int i = 0; i < kSegments; ++i) {
    const std::uint32_t point = on_ring(ring, is_top ? i : kSegments - i);
    const Vector3d p = faces.points[point] / (2 * radius);
    add_corner(faces, point, {.5 + p.x(), is_top ? .5 - p.z() : .5 + p.z()});
  }
  faces.end_face();
}

}  // namespace

FaceList box(const Vector3d& size) {
  FaceList faces;
  for (int i = 0; i < 8; ++i)
    faces.points.push_back(size.cwiseProduct(Vector3d(i & 1 ? .5 : -.5, i & 2 ? .5 : -.5, i & 4 ? .5 : -.5)));
  // Lower left, lower right, upper right, upper left of each side, as one reads it from outside.
  constexpr std::uint32_t kSides[6][4] = {{4, 5, 7, 6}, {1, 0, 2, 3}, {5, 1, 3, 7},
                                          {0, 4, 6, 2}, {6, 7, 3, 2}, {0, 1, 5, 4}};
  for (const auto& side : kSides) {
    add_corner(faces, side[0], {0, 0});
    add_corner(faces, side[1], {1, 0});
    add_corner(faces, side[2], {1, 1});
    add_corner(faces, side[3], {0, 1});
    faces.end_face();
  }
  return faces;
}

FaceList sphere(double radius) {
  constexpr int kBands = kSegments / 2;
  FaceList faces;
  faces.points.emplace_back(0, -radius, 0);
  faces.points.emplace_back(0, radius, 0);
  std::uint32_t lower = 0;
  for (int band = 1; band < kBands; ++band) {
    const double v = static_cast<double>(band) / kBands;
    const double latitude = std::numbers::pi * (v - .5);
    const std::uint32_t ring = add_ring(faces, radius * std::cos(latitude), radius * std::sin(latitude));
    if (band == 1)
      add_fan(faces, ring, 0, false, v, 0);
    else
      add_band(faces, lower, ring, v - 1. / kBands, v);
    lower = ring;
  }
  add_fan(faces, lower, 1, true, 1 - 1. / kBands, 1);
  return faces;
}

FaceList cylinder(double radius, double height, const Parts& parts) {
  FaceList faces;
  const std::uint32_t lower = add_ring(faces, radius, -height / 2);
  const std::uint32_t upper = add_ring(faces, radius, height / 2);
  if (parts.side) add_band(faces, lower, upper, 0, 1);
  if (parts.top) add_disc(faces, upper, radius, true);
  if (parts.bottom) add_disc(faces, lower, radius, false);
  return faces;
}

FaceList cone(double radius, double height, const Parts& parts) {
  FaceList faces;
  const std::uint32_t ring = add_ring(faces, radius, -height / 2);
  const auto tip = static_cast<std::uint32_t>(faces.points.size());
  faces.points.emplace_back(0, height / 2, 0);
  if (parts.side) add_fan(faces, ring, tip, true, 0, 1);
  if (parts.bottom) add_disc(faces, ring, radius, false);
  return faces;
}

}  // namespace hilbrush::vrml
