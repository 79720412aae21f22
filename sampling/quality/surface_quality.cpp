#include "sampling/quality/surface_quality.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "sampling/base/check.h"
#include "sampling/base/input_error.h"
#include "sampling/model/nearest_in_triangle.h"
#include "sampling/quality/dots_on_surface.h"
#include "sampling/quality/holes.h"
#include "sampling/quality/spacing.h"
#include "sampling/tone/tone_polygon.h"

namespace hilbrush {
namespace {

using Eigen::Vector2d, Eigen::Vector3d;

TriangleMasses measure_masses(const TexturedMesh& mesh, const ToneField* tone) {
  const std::size_t n = mesh.triangle_count();
  TriangleMasses result{std::vector<double>(n), std::vector<std::uint8_t>(n, 1)};
  std::vector<double>& masses = result.masses;
  std::vector<std::uint8_t>& is_even = result.is_even;
  tbb::parallel_for(std::size_t{0}, n, [&](std::size_t t) {
    if (!tone) {
      masses[t] = mesh.area_vector(t).norm();
      return;
    }
    const std::array<Vector2d, 3> whole{Vector2d(0, 0), Vector2d(1, 0), Vector2d(0, 1)};
    const ToneIntegral integral = tone->integrate(static_cast<std::uint32_t>(t), whole);
    masses[t] = integral.mass;
    const double square_if_even = integral.area_m2 > 0 ? integral.mass * integral.mass / integral.area_m2 : 0;
    is_even[t] = integral.square <= square_if_even * (1 + 1e-9) ? 1 : 0;
  });
  return result;
}

/// Signed area that a disc around the origin has in common with the triangle (origin, a, b).
double disc_side_area(double radius, const Vector2d& a, const Vector2d& b) {
  const auto cross = [](const Vector2d& p, const Vector2d& q) { return p.x() * q.y() - p.y() * q.x(); };
  const double radius2 = radius * radius;
  const auto sector = [&](const Vector2d& p, const Vector2d& q) {
    return .5 * radius2 * std::atan2(cross(p, q), p.dot(q));
  };
  if (a.squaredNorm() <= radius2 && b.squaredNorm() <= radius2) return .5 * cross(a, b);
  const Vector2d d = b - a;
  const double half_b = a.dot(d);
  const double dd = d.squaredNorm();
  const double discriminant = half_b * half_b - dd * (a.squaredNorm() - radius2);
  if (!(discriminant > 0) || !(dd > 0)) return sector(a, b);
  const double root = std::sqrt(discriminant);
  const double in = std::clamp((-half_b - root) / dd, 0., 1.);
  const double out = std::clamp((-half_b + root) / dd, 0., 1.);
  if (!(out > in)) return sector(a, b);
  const Vector2d p = a + in * d;
  const Vector2d q = a + out * d;
  return (in > 0 ? sector(a, p) : 0) + .5 * cross(p, q) + (out < 1 ? sector(q, b) : 0);
}

/// The triangle's own plane: x along its first side.
struct Flat {
  Vector3d x, y;
  Flat(const TexturedMesh& mesh, std::uint32_t triangle)
      : x((mesh.corner(triangle, 1) - mesh.corner(triangle, 0)).normalized()),
        y(mesh.area_vector(triangle).normalized().cross(x)) {}
  Vector2d operator()(const Vector3d& v) const { return {v.dot(x), v.dot(y)}; }
};

/// The part of a convex polygon to the left of the line from p to q.
std::vector<Vector2d> clip(const std::vector<Vector2d>& polygon, const Vector2d& p, const Vector2d& q) {
  const Vector2d inward(-(q - p).y(), (q - p).x());
  std::vector<Vector2d> kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double at_a = inward.dot(a - p);
    const double at_b = inward.dot(b - p);
    if (at_a >= 0) kept.push_back(a);
    if ((at_a > 0 && at_b < 0) || (at_a < 0 && at_b > 0)) kept.push_back(a + at_a / (at_a - at_b) * (b - a));
  }
  return kept;
}

/// A regular polygon with the same area as the disc.
std::vector<Vector2d> polygon_like_disc(double radius) {
  constexpr int kSides = 64;
  const double step = 2 * std::numbers::pi / kSides;
  const double stretched = radius * std::sqrt(step / std::sin(step));
  std::vector<Vector2d> polygon;
  for (int i = 0; i < kSides; ++i)
    polygon.emplace_back(stretched * std::cos(i * step), stretched * std::sin(i * step));
  return polygon;
}

/// The mass of a convex polygon in barycentric coordinates: of fans from its first corner that have no more
/// corners than a tone can integrate at once.
double mass_of_polygon(const ToneField& tone, std::uint32_t triangle, const std::vector<Vector2d>& polygon) {
  constexpr std::size_t kStep = kMaxPolygonCorners - 2;
  double mass = 0;
  for (std::size_t first = 1; first + 1 < polygon.size(); first += kStep) {
    const std::size_t last = std::min(first + kStep, polygon.size() - 1);
    std::vector<Vector2d> fan{polygon.front()};
    for (std::size_t i = first; i <= last; ++i) fan.push_back(polygon[i]);
    mass += tone.integrate(triangle, fan).mass;
  }
  return mass;
}

}  // namespace

double disc_triangle_area(double radius, const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  return disc_side_area(radius, a, b) + disc_side_area(radius, b, c) + disc_side_area(radius, c, a);
}

SurfaceQuality::Implementation::Implementation(const TexturedMesh& m, const ToneField* t)
    : Implementation(m, t, measure_masses(m, t)) {}

SurfaceQuality::Implementation::Implementation(const TexturedMesh& m, const ToneField* t,
                                               TriangleMasses measured)
    : mesh(m),
      tone(t),
      is_even(std::move(measured.is_even)),
      masses(std::move(measured.masses)),
      neighbors(find_neighbors(m.triangles)),
      tree(m, masses) {
  mass_sums.resize(masses.size());
  std::partial_sum(masses.begin(), masses.end(), mass_sums.begin());
  mass = mass_sums.empty() ? 0 : mass_sums.back();
  if (!(mass > 0))
    throw InputError("", "there is nothing to cover: the surface has no area or asks for no dots");
  const auto box = bounds(mesh);
  diagonal_m = (box[1] - box[0]).norm();
}

double SurfaceQuality::Implementation::mass_in_ball(std::uint32_t triangle, const Vector3d& center,
                                                    double radius) const {
  const Vector3d normal = mesh.area_vector(triangle).normalized();
  const double height = normal.dot(center - mesh.corner(triangle, 0));
  if (std::abs(height) >= radius || !(masses[triangle] > 0)) return 0;
  const double disc_radius = std::sqrt(radius * radius - height * height);
  const Flat flat(mesh, triangle);
  std::array<Vector2d, 3> corners;
  for (int c = 0; c < 3; ++c) corners[static_cast<std::size_t>(c)] = flat(mesh.corner(triangle, c) - center);
  if (is_even[triangle]) {
    const double share = disc_triangle_area(disc_radius, corners[0], corners[1], corners[2]) /
                         mesh.area_vector(triangle).norm();
    return std::clamp(share, 0., 1.) * masses[triangle];
  }
  std::vector<Vector2d> polygon = polygon_like_disc(disc_radius);
  for (std::size_t c = 0; c < 3 && !polygon.empty(); ++c)
    polygon = clip(polygon, corners[c], corners[(c + 1) % 3]);
  if (polygon.size() < 3) return 0;
  Eigen::Matrix2d sides;
  sides << corners[1] - corners[0], corners[2] - corners[0];
  const Eigen::Matrix2d to_barycentric = sides.inverse();
  for (Vector2d& p : polygon) p = to_barycentric * (p - corners[0]);
  return mass_of_polygon(*tone, triangle, polygon);
}

SurfacePoint SurfaceQuality::Implementation::random_point(double which, double u, double v) const {
  const auto found = std::upper_bound(mass_sums.begin(), mass_sums.end(), which * mass);
  const auto triangle = static_cast<std::uint32_t>(
      std::min<std::ptrdiff_t>(found - mass_sums.begin(), static_cast<std::ptrdiff_t>(mass_sums.size()) - 1));
  const double root = std::sqrt(u);
  return {triangle, {1 - root, root * (1 - v), root * v}};
}

double SurfaceQuality::Implementation::density_at(const Vector3d& place, std::uint32_t triangle) const {
  if (!tone) return 1;
  return tone->asked({triangle, nearest_in_triangle(place, mesh.corner(triangle, 0), mesh.corner(triangle, 1),
                                                    mesh.corner(triangle, 2))});
}

SurfaceQuality::SurfaceQuality(const TexturedMesh& mesh, const ToneField* tone)
    : implementation_(std::make_unique<Implementation>(mesh, tone)) {
  CHECK(tone == nullptr || &tone->mesh() == &mesh);
}
SurfaceQuality::~SurfaceQuality() = default;
SurfaceQuality::SurfaceQuality(SurfaceQuality&&) noexcept = default;

double SurfaceQuality::mass_m2() const {
  return implementation_->mass;
}

SurfacePoint SurfaceQuality::nearest(const Vector3d& position_O) const {
  return implementation_->tree.nearest(position_O);
}

double SurfaceQuality::share_in_ball(const Vector3d& center_O, double radius_m) const {
  const Implementation& surface = *implementation_;
  return surface.tree.mass_within(center_O, radius_m, [&](std::uint32_t t) {
    return surface.mass_in_ball(t, center_O, radius_m);
  }) / surface.mass;
}

Spacing SurfaceQuality::spacing(std::span<const Dot> dots) const {
  const Implementation& surface = *implementation_;
  const DotsOnSurface on_surface(surface.mesh, surface.neighbors, dots);
  const double densest =
      densest_packing_distance(surface.mass / static_cast<double>(std::max<std::size_t>(dots.size(), 1)));
  std::vector<double> distances(dots.size());
  tbb::parallel_for(std::size_t{0}, dots.size(), [&](std::size_t i) {
    const Dot& dot = dots[i];
    const double density = surface.density_at(dot.position_O, dot.triangle);
    distances[i] = on_surface.distance(dot.position_O, dot.triangle, static_cast<std::uint32_t>(i)) /
                   densest * std::sqrt(density);
  });
  return spacing_figures(std::move(distances));
}

double SurfaceQuality::largest_hole(std::span<const Dot> dots) const {
  CHECK(!dots.empty());
  const Implementation& surface = *implementation_;
  const DotsOnSurface on_surface(surface.mesh, surface.neighbors, dots);
  const double pitch = std::sqrt(surface.mass / static_cast<double>(dots.size()));
  std::vector<SearchTriangle> triangles;
  for (std::uint32_t t = 0; t < surface.mesh.triangle_count(); ++t)
    if (surface.masses[t] > 0)
      triangles.push_back(
          {{surface.mesh.corner(t, 0), surface.mesh.corner(t, 1), surface.mesh.corner(t, 2)}, t});
  const auto distance = [&](const Vector3d& place, std::uint32_t face) {
    const double density = surface.density_at(place, face);
    return density > 0 ? on_surface.distance(place, face) * std::sqrt(density) : 0;
  };
  SearchLimits limits;
  if (surface.tone) limits.smallest_m = pitch / 8;
  return largest_distance(std::move(triangles), distance, limits) / pitch;
}

double SurfaceQuality::path_constant(std::span<const Dot> dots) const {
  CHECK(!dots.empty());
  double sum = 0;
  for (std::size_t i = 1; i < dots.size(); ++i) sum += (dots[i].position_O - dots[i - 1].position_O).norm();
  return sum / std::sqrt(static_cast<double>(dots.size()) * mass_m2());
}

}  // namespace hilbrush
