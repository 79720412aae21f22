#include "sim/film/film_lattice.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "sampling/check.h"
#include "sampling/input_error.h"

namespace hilbrush {

namespace {

/// Beyond this much of the beam's direction along the face there is no dose: grazing light, and faces that look away.
constexpr double kGrazingCosine = .02;
/// Light is followed so many cut radii before and behind the place it hit: enough for incidences up to 63 degrees.
constexpr double kDepthWindow = 2;

std::uint32_t steps_over(double length_m, double spacing_m) {
  return static_cast<std::uint32_t>(std::clamp(std::ceil(length_m / spacing_m - 1e-9), 1., 4e9));
}

int corner_opposite_longest_edge(const TexturedMesh& mesh, std::size_t t) {
  int apex = 0;
  double longest = -1;
  for (int c = 0; c < 3; ++c) {
    const double squared = (mesh.corner(t, (c + 1) % 3) - mesh.corner(t, (c + 2) % 3)).squaredNorm();
    if (squared > longest) longest = squared, apex = c;
  }
  return apex;
}

/// Two unit vectors that make a right-handed frame with the third (Duff et al. 2017).
void complete_basis(const Eigen::Vector3d& z, Eigen::Vector3d& x, Eigen::Vector3d& y) {
  const double sign = std::copysign(1., z.z()), a = -1 / (sign + z.z()), b = z.x() * z.y() * a;
  x = {1 + sign * z.x() * z.x() * a, sign * b, -sign * z.x()};
  y = {b, sign + z.y() * z.y() * a, -z.y()};
}

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

}  // namespace

/// A grid in the coordinates of an axis: two across it, from the axis, and the depth along it. A point at v of the way
/// from base edge to apex and at t of its row is base + v lift + t (1 - v) along.
struct FilmLattice::Frame {
  Eigen::Vector2d base, lift, along;
  double base_depth, lift_depth, along_depth;
  double radius;

  Frame(const Eigen::Vector3d& b, const Eigen::Vector3d& c, const Eigen::Vector3d& apex,
        const Eigen::Vector3d& center_O, const Eigen::Vector3d& axis_O, double radius_m)
      : radius(radius_m) {
    Eigen::Vector3d x, y;
    complete_basis(axis_O, x, y);
    const auto across = [&](const Eigen::Vector3d& v) { return Eigen::Vector2d(x.dot(v), y.dot(v)); };
    base = across(b - center_O), lift = across(apex - b), along = across(c - b);
    base_depth = axis_O.dot(b - center_O), lift_depth = axis_O.dot(apex - b), along_depth = axis_O.dot(c - b);
  }

  /// Rows whose line comes within the radius of the axis; none if the triangle as a whole stays off along the rows.
  RowRange rows(std::uint32_t row_steps) const {
    const double length = along.norm();
    if (length <= 0) return {0, row_steps + 1};
    const double start = base.dot(along) / length, apex = start + lift.dot(along) / length;
    if (std::min(start, apex) > radius || std::max(start + length, apex) < -radius) return {0, 0};
    const double at_base = cross(base, along) / length, rise = cross(lift, along) / length;
    double low = 0, high = 1;
    if (rise == 0) {
      if (std::abs(at_base) > radius) return {0, 0};
    } else {
      const double v1 = (-radius - at_base) / rise, v2 = (radius - at_base) / rise;
      low = std::max(low, std::min(v1, v2)), high = std::min(high, std::max(v1, v2));
      if (low > high) return {0, 0};
    }
    constexpr double kRounding = 1e-9;
    return {static_cast<std::uint32_t>(std::ceil(low * row_steps - kRounding)),
            static_cast<std::uint32_t>(std::floor(high * row_steps + kRounding)) + 1};
  }
};

FilmLattice::FilmLattice(const TexturedMesh& mesh, double spacing_m) : mesh_(mesh), grids_(mesh.triangle_count()) {
  constexpr std::uint32_t kTilePoints = 4096, kTileRowsMin = 16, kTileRowsMax = 4096;
  CHECK(spacing_m > 0);
  std::size_t row_count = 0;
  double point_estimate = 0;
  for (std::size_t t = 0; t < grids_.size(); ++t) {
    Grid& grid = grids_[t];
    grid.apex = static_cast<std::uint8_t>(corner_opposite_longest_edge(mesh, t));
    const auto index = static_cast<std::uint32_t>(t);
    const double base_m = (corner(index, grid, 1) - corner(index, grid, 2)).norm();
    const double height_m = base_m > 0 ? 2 * mesh.area_vector(t).norm() / base_m : 0;
    grid.base_steps = steps_over(base_m, spacing_m);
    grid.row_steps = steps_over(height_m, spacing_m);
    point_estimate += (.5 * grid.base_steps + 1) * (grid.row_steps + 1.);
    if (point_estimate > kPointLimit)
      throw InputError("", "the film of this object would need more than " +
                               std::to_string(static_cast<long>(kPointLimit / 1e6)) +
                               " million points: choose a smaller size or a lower dpi");
    grid.rows_per_tile =
        static_cast<std::uint16_t>(std::clamp(kTilePoints / (grid.base_steps + 1), kTileRowsMin, kTileRowsMax));
    grid.first_row = static_cast<std::uint32_t>(row_count);
    grid.first_tile = tile_count_;
    row_count += grid.row_steps + 1;
    tile_count_ += grid.row_steps / grid.rows_per_tile + 1;
  }

  first_point_.reserve(row_count + 1);
  tile_triangle_.reserve(tile_count_);
  std::uint32_t point_count = 0;
  for (std::uint32_t t = 0; t < grids_.size(); ++t) {
    const Grid& grid = grids_[t];
    for (std::uint32_t row = 0; row <= grid.row_steps; ++row) {
      first_point_.push_back(point_count);
      point_count += steps_of_row(grid, row) + 1;
    }
    tile_triangle_.insert(tile_triangle_.end(), grid.row_steps / grid.rows_per_tile + 1, t);
  }
  first_point_.push_back(point_count);
  doses_.assign(point_count, 0);
}

/// Visits (row, place in the row, steps of the row, squared distance from the axis, depth) of every point within the
/// frame's radius.
template <class Visit>
void FilmLattice::visit_points(std::uint32_t triangle, const Frame& frame, RowRange rows, Visit visit) const {
  const Grid& grid = grids_[triangle];
  const double radius2 = frame.radius * frame.radius;
  for (std::uint32_t row = rows.first; row < rows.end; ++row) {
    const double v = static_cast<double>(row) / grid.row_steps;
    const std::uint32_t steps = steps_of_row(grid, row);
    const Eigen::Vector2d start = frame.base + v * frame.lift;
    const double scale = steps > 0 ? (1 - v) / steps : 0, depth = frame.base_depth + v * frame.lift_depth;
    const Eigen::Vector2d step = scale * frame.along;
    const double a = step.squaredNorm(), b = start.dot(step), c = start.squaredNorm();
    std::uint32_t first = 0, last = steps;
    if (a > 0) {
      const double discriminant = b * b - a * (c - radius2);
      if (discriminant < 0) continue;
      const double root = std::sqrt(discriminant);
      const double low = std::ceil((-b - root) / a), high = std::floor((-b + root) / a);
      if (high < 0 || low > steps || low > high) continue;
      first = low > 0 ? static_cast<std::uint32_t>(low) : 0;
      last = high < steps ? static_cast<std::uint32_t>(high) : steps;
    } else if (c > radius2) {
      continue;
    }
    for (std::uint32_t i = first; i <= last; ++i)
      visit(row, i, steps, c + i * (2 * b + i * a), depth + i * scale * frame.along_depth);
  }
}

void FilmLattice::append_tiles(std::uint32_t triangle, const Spot& spot, std::vector<std::uint32_t>& tiles) const {
  const Grid& grid = grids_[triangle];
  const Eigen::Vector3d area = mesh_.area_vector(triangle);
  if (-spot.direction_O.dot(area) <= kGrazingCosine * area.norm()) return;
  const Frame frame(corner(triangle, grid, 1), corner(triangle, grid, 2), corner(triangle, grid, 0), spot.center_O,
                    spot.direction_O, kSpotCutRadii * spot.radius_m);
  const RowRange rows = frame.rows(grid.row_steps);
  if (rows.first >= rows.end) return;
  const std::uint32_t first_tile = rows.first / grid.rows_per_tile, last_tile = (rows.end - 1) / grid.rows_per_tile;
  for (std::uint32_t tile = first_tile; tile <= last_tile; ++tile) tiles.push_back(grid.first_tile + tile);
}

void FilmLattice::expose(std::uint32_t tile, std::span<const Spot* const> spots) {
  const std::uint32_t triangle = tile_triangle_[tile];
  const Grid& grid = grids_[triangle];
  const std::uint32_t tile_first = (tile - grid.first_tile) * grid.rows_per_tile;
  const std::uint32_t tile_end = std::min(tile_first + grid.rows_per_tile, grid.row_steps + 1);
  const Eigen::Vector3d normal_O = mesh_.area_vector(triangle).normalized();
  const Eigen::Vector3d& b = corner(triangle, grid, 1);
  const Eigen::Vector3d& c = corner(triangle, grid, 2);
  const Eigen::Vector3d& apex = corner(triangle, grid, 0);
  static const double kInside = 1 - std::exp(-2 * kSpotCutRadii * kSpotCutRadii);

  for (const Spot* spot : spots) {
    const Frame frame(b, c, apex, spot->center_O, spot->direction_O, kSpotCutRadii * spot->radius_m);
    RowRange rows = frame.rows(grid.row_steps);
    rows = {std::max(rows.first, tile_first), std::min(rows.end, tile_end)};
    const double radius2 = spot->radius_m * spot->radius_m;
    const double cosine = -spot->direction_O.dot(normal_O);
    const auto peak = static_cast<float>(2 * spot->energy_j * cosine / (std::numbers::pi * radius2 * kInside));
    const auto falloff = static_cast<float>(-2 / radius2);
    const double window = kDepthWindow * frame.radius;
    visit_points(
        triangle, frame, rows, [&](std::uint32_t row, std::uint32_t i, std::uint32_t, double distance2, double depth) {
          if (std::abs(depth) > window) return;
          doses_[first_point_[grid.first_row + row] + i] += peak * std::exp(falloff * static_cast<float>(distance2));
        });
  }
}

double FilmLattice::dose_on_row(const Grid& grid, std::uint32_t row, double along) const {
  const float* doses = &doses_[first_point_[grid.first_row + row]];
  const std::uint32_t steps = steps_of_row(grid, row);
  if (steps == 0) return doses[0];
  const double place = std::clamp(along, 0., 1.) * steps;
  const std::uint32_t i = std::min(static_cast<std::uint32_t>(place), steps - 1);
  const double fraction = place - i;
  return (1 - fraction) * doses[i] + fraction * doses[i + 1];
}

double FilmLattice::dose_j_m2(const SurfacePoint& point) const {
  const Grid& grid = grids_[point.triangle];
  const double apex = std::clamp(point.barycentric[grid.apex], 0., 1.);
  const double start = point.barycentric[(grid.apex + 1) % 3], end = point.barycentric[(grid.apex + 2) % 3];
  const double along = start + end > 0 ? end / (start + end) : .5;
  const double place = apex * grid.row_steps;
  const std::uint32_t row = std::min(static_cast<std::uint32_t>(place), grid.row_steps - 1);
  const double fraction = place - row;
  return (1 - fraction) * dose_on_row(grid, row, along) + fraction * dose_on_row(grid, row + 1, along);
}

/// The part of the triangle's area that a row stands for: the integral of its hat function times the width of the
/// triangle there.
double FilmLattice::row_area_share(const Grid& grid, std::uint32_t row) const {
  const double m = grid.row_steps;
  if (row == 0) return 1 / m - 1 / (3 * m * m);
  if (row == grid.row_steps) return 1 / (3 * m * m);
  return 2 * (1 - row / m) / m;
}

void FilmLattice::append_points(std::uint32_t triangle, const Eigen::Vector3d& center_O,
                                const Eigen::Vector3d& normal_O, double radius_m,
                                std::vector<FilmPoint>& points) const {
  const Grid& grid = grids_[triangle];
  const Eigen::Vector3d& b = corner(triangle, grid, 1);
  const Eigen::Vector3d& c = corner(triangle, grid, 2);
  const Eigen::Vector3d& apex = corner(triangle, grid, 0);
  const Frame frame(b, c, apex, center_O, normal_O, radius_m);
  const double area_m2 = mesh_.area_vector(triangle).norm();
  visit_points(triangle, frame, frame.rows(grid.row_steps),
               [&](std::uint32_t row, std::uint32_t i, std::uint32_t steps, double, double depth) {
                 if (std::abs(depth) > radius_m) return;
                 const double v = static_cast<double>(row) / grid.row_steps,
                              t = steps > 0 ? static_cast<double>(i) / steps : 0;
                 FilmPoint& film_point = points.emplace_back();
                 film_point.point.triangle = triangle;
                 film_point.point.barycentric[grid.apex] = v;
                 film_point.point.barycentric[(grid.apex + 1) % 3] = (1 - v) * (1 - t);
                 film_point.point.barycentric[(grid.apex + 2) % 3] = (1 - v) * t;
                 film_point.position_O = v * apex + (1 - v) * ((1 - t) * b + t * c);
                 const double share = steps == 0 ? 1 : (i == 0 || i == steps ? .5 : 1) / steps;
                 film_point.area_m2 = area_m2 * row_area_share(grid, row) * share;
                 film_point.dose_j_m2 = doses_[first_point_[grid.first_row + row] + i];
               });
}

}  // namespace hilbrush
