#include "sim/film/film_lattice.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "sampling/base/check.h"
#include "sampling/base/cross.h"
#include "sampling/base/frame.h"
#include "sampling/base/input_error.h"

namespace hilbrush {

namespace {

/// Beyond this much of the beam's direction along the face there is no dose: grazing light, and faces turned
/// away.
constexpr double kGrazingCosine = .02;
/// Light is followed this many cut radii before and behind the point that it hit: enough for incidences up to
/// 63 degrees.
constexpr double kDepthWindow = 2;

std::uint32_t steps_over(double length_m, double spacing_m) {
  return static_cast<std::uint32_t>(std::clamp(std::ceil(length_m / spacing_m - 1e-9), 1., 4e9));
}

int corner_opposite_longest_edge(const TexturedMesh& mesh, std::size_t t) {
  int apex = 0;
  double longest = -1;
  for (int c = 0; c < 3; ++c) {
    const double squared = (mesh.corner(t, (c + 1) % 3) - mesh.corner(t, (c + 2) % 3)).squaredNorm();
    if (squared > longest) {
      longest = squared;
      apex = c;
    }
  }
  return apex;
}

}  // namespace

/// A grid in the coordinates of an axis: two across it, from the axis, and the depth along it. The place at s
/// meters along the longest edge and y meters above it is start + s along + y up.
struct FilmLattice::Frame {
  Eigen::Vector2d start, along, up;
  double start_depth, along_depth, up_depth;
  double radius;
  const Grid& grid;

  double row_step() const { return static_cast<double>(grid.height_m) / grid.rows; }
  double column_step() const { return static_cast<double>(grid.length_m) / grid.columns; }

  /// Of `count` lines parallel to the rows, the first y0 above the longest edge and the others one row step
  /// apart, those that pass the axis within the radius and between the ends of the longest edge.
  RowRange lines_near(double y0, std::uint32_t count) const {
    const double stretch = along.norm();  // > 0 unless the axis runs along the rows: then nothing faces it
    if (!(stretch > 0)) return {0, 0};
    const double step = row_step();
    const double first = cross(along, start + y0 * up) / stretch;
    const double rise = cross(along, up) / stretch * step;
    double low = 0;
    double high = count - 1.;
    if (rise != 0) {
      const double j1 = (-radius - first) / rise;
      const double j2 = (radius - first) / rise;
      low = std::max(low, std::ceil(std::min(j1, j2))), high = std::min(high, std::floor(std::max(j1, j2)));
    } else if (std::abs(first) > radius) {
      return {0, 0};
    }
    if (low > high) return {0, 0};
    const double reach = radius / stretch;
    const double slack = column_step();
    const auto nearest = [&](double line) {
      return -along.dot(start + (y0 + line * step) * up) / (stretch * stretch);
    };
    const double s1 = nearest(low);
    const double s2 = nearest(high);
    if (std::max(s1, s2) + reach < -slack || std::min(s1, s2) - reach > grid.length_m + slack) return {0, 0};
    return {static_cast<std::uint32_t>(low), static_cast<std::uint32_t>(high) + 1};
  }

  /// Visits (i, squared distance from the axis, depth) for those of `count` places, from s0 on and `step`
  /// apart at height y, that lie within the radius.
  template <class Visit>
  void visit_line(double y, double s0, double step, std::uint32_t count, Visit visit) const {
    const Eigen::Vector2d place = start + y * up + s0 * along;
    const Eigen::Vector2d delta = step * along;
    const double a = delta.squaredNorm();
    const double b = place.dot(delta);
    const double c = place.squaredNorm();
    const double discriminant = b * b - a * (c - radius * radius);
    if (discriminant < 0 || !(a > 0)) return;
    const double root = std::sqrt(discriminant);
    const double low = std::max(std::ceil((-b - root) / a), 0.);
    const double high = std::min(std::floor((-b + root) / a), count - 1.);
    const double depth = start_depth + y * up_depth + s0 * along_depth;
    const double depth_step = step * along_depth;
    for (double i = low; i <= high; ++i)
      visit(static_cast<std::uint32_t>(i), c + i * (2 * b + i * a), depth + i * depth_step);
  }
};

FilmLattice::Frame FilmLattice::frame_of(std::uint32_t triangle, const Eigen::Vector3d& center_O,
                                         const Eigen::Vector3d& axis_O, double radius_m) const {
  const Grid& grid = grids_[triangle];
  const Eigen::Vector3d& origin = mesh_.corner(triangle, (grid.apex + 1) % 3);
  const Eigen::Vector3d along = (mesh_.corner(triangle, (grid.apex + 2) % 3) - origin).normalized();
  const Eigen::Vector3d up = mesh_.area_vector(triangle).cross(along).normalized();
  const Eigen::Matrix3d axes = frame_about(axis_O);
  const auto across = [&](const Eigen::Vector3d& v) {
    return Eigen::Vector2d(axes.col(0).dot(v), axes.col(1).dot(v));
  };
  const Eigen::Vector3d from_axis = origin - center_O;
  return {across(from_axis), across(along),  across(up), axis_O.dot(from_axis),
          axis_O.dot(along), axis_O.dot(up), radius_m,   grid};
}

FilmLattice::FilmLattice(const TexturedMesh& mesh, double spacing_m)
    : mesh_(mesh), grids_(mesh.triangle_count()) {
  constexpr std::uint32_t kTileNodes = 4096, kTileRowsMin = 16, kTileRowsMax = 4096;
  CHECK(spacing_m > 0);
  double node_estimate = 0;
  for (std::size_t t = 0; t < grids_.size(); ++t) {
    Grid& grid = grids_[t];
    grid.apex = static_cast<std::uint8_t>(corner_opposite_longest_edge(mesh, t));
    const Eigen::Vector3d& origin = mesh.corner(t, (grid.apex + 1) % 3);
    const Eigen::Vector3d base = mesh.corner(t, (grid.apex + 2) % 3) - origin;
    const double length_m = base.norm();
    grid.length_m = static_cast<float>(length_m);
    grid.height_m = length_m > 0 ? static_cast<float>(2 * mesh.area_vector(t).norm() / length_m) : 0;
    grid.foot_m =
        length_m > 0 ? static_cast<float>(base.dot(mesh.corner(t, grid.apex) - origin) / length_m) : 0;
    grid.columns = steps_over(length_m, spacing_m);
    grid.rows = steps_over(grid.height_m, spacing_m);
    node_estimate += (.5 * grid.columns + 2) * (grid.rows + 1.);
    if (node_estimate > kMaxNodes)
      throw InputError("", "the film of this object would need more than " +
                               std::to_string(static_cast<long>(kMaxNodes / 1e6)) +
                               " million nodes: choose a smaller size or a lower dpi");
    grid.rows_per_tile =
        static_cast<std::uint16_t>(std::clamp(kTileNodes / (grid.columns + 1), kTileRowsMin, kTileRowsMax));
    grid.first_tile = tile_count();
    tile_triangle_.insert(tile_triangle_.end(), grid.rows / grid.rows_per_tile + 1,
                          static_cast<std::uint32_t>(t));
  }

  std::uint32_t node_count = 0;
  for (Grid& grid : grids_) {
    grid.first_row = static_cast<std::uint32_t>(rows_.size());
    for (std::uint32_t row = 0; row <= grid.rows; ++row) {
      // The triangle narrows upwards, so what it is widest in, of the strips below and above the row, is the
      // lower line of the one below.
      const double share = row > 0 ? (row - 1.) / grid.rows : 0;
      const double foot = grid.length_m > 0 ? grid.foot_m / grid.length_m : 0;
      const auto first = static_cast<std::uint32_t>(
          std::clamp(std::floor(share * foot * grid.columns), 0., grid.columns - 1.));
      const double end = std::ceil((1 - share * (1 - foot)) * grid.columns);
      const auto last =
          static_cast<std::uint32_t>(std::clamp(end, first + 1., static_cast<double>(grid.columns)));
      rows_.push_back({node_count, first});
      node_count += last - first + 1;
    }
  }
  rows_.push_back({node_count, 0});
  doses_.assign(node_count, 0);
}

void FilmLattice::append_tiles(std::uint32_t triangle, const Spot& spot,
                               std::vector<std::uint32_t>& tiles) const {
  const Grid& grid = grids_[triangle];
  const Eigen::Vector3d area = mesh_.area_vector(triangle);
  if (-spot.direction_O.dot(area) <= kGrazingCosine * area.norm()) return;
  const Frame frame = frame_of(triangle, spot.center_O, spot.direction_O, kSpotCutRadii * spot.radius_m);
  const RowRange rows = frame.lines_near(0, grid.rows + 1);
  if (rows.first >= rows.end) return;
  const std::uint32_t first_tile = rows.first / grid.rows_per_tile;
  const std::uint32_t last_tile = (rows.end - 1) / grid.rows_per_tile;
  for (std::uint32_t tile = first_tile; tile <= last_tile; ++tile) tiles.push_back(grid.first_tile + tile);
}

void FilmLattice::expose(std::uint32_t tile, std::span<const Spot* const> spots) {
  const std::uint32_t triangle = tile_triangle_[tile];
  const Grid& grid = grids_[triangle];
  const std::uint32_t tile_first = (tile - grid.first_tile) * grid.rows_per_tile;
  const std::uint32_t tile_end = std::min(tile_first + grid.rows_per_tile, grid.rows + 1);
  const Eigen::Vector3d normal_O = mesh_.area_vector(triangle).normalized();
  static const double kInside = 1 - std::exp(-2 * kSpotCutRadii * kSpotCutRadii);

  for (const Spot* spot : spots) {
    const Frame frame = frame_of(triangle, spot->center_O, spot->direction_O, kSpotCutRadii * spot->radius_m);
    const RowRange near = frame.lines_near(0, grid.rows + 1);
    const double radius2 = spot->radius_m * spot->radius_m;
    const double cosine = -spot->direction_O.dot(normal_O);
    const auto peak =
        static_cast<float>(2 * spot->energy_j * cosine / (std::numbers::pi * radius2 * kInside));
    const auto falloff = static_cast<float>(-2 / radius2);
    const double window = kDepthWindow * frame.radius;
    const double row_step = frame.row_step();
    const double column_step = frame.column_step();
    for (std::uint32_t j = std::max(near.first, tile_first); j < std::min(near.end, tile_end); ++j) {
      const Row& row = rows_[grid.first_row + j];
      const std::uint32_t count = rows_[grid.first_row + j + 1].first_node - row.first_node;
      frame.visit_line(j * row_step, row.first_column * column_step, column_step, count,
                       [&](std::uint32_t i, double distance2, double depth) {
                         if (std::abs(depth) > window) return;
                         doses_[row.first_node + i] +=
                             peak * std::exp(falloff * static_cast<float>(distance2));
                       });
    }
  }
}

FilmLattice::Neighbors FilmLattice::neighbors(const SurfacePoint& point) const {
  const Grid& grid = grids_[point.triangle];
  const double apex = std::clamp(point.barycentric[grid.apex], 0., 1.);
  const double end = std::clamp(point.barycentric[(grid.apex + 2) % 3], 0., 1.);
  const double foot = grid.length_m > 0 ? grid.foot_m / grid.length_m : 0;
  const double y = apex * grid.rows;
  const double s = std::min(end + apex * foot, 1.) * grid.columns;
  const std::uint32_t lower = std::min(static_cast<std::uint32_t>(y), grid.rows - 1);
  Neighbors neighbors;
  for (std::uint32_t k = 0; k < 2; ++k) {
    const Row& row = rows_[grid.first_row + lower + k];
    const std::uint32_t steps = rows_[grid.first_row + lower + k + 1].first_node - row.first_node - 1;
    const double place = std::clamp(s - row.first_column, 0., static_cast<double>(steps));
    const std::uint32_t i = std::min(static_cast<std::uint32_t>(place), steps - 1);
    const double row_weight = k == 0 ? 1 - (y - lower) : y - lower;
    const double along = place - i;
    for (std::uint32_t n = 0; n < 2; ++n) {
      neighbors.doses_j_m2[2 * k + n] = doses_[row.first_node + i + n];
      neighbors.weights[2 * k + n] = row_weight * (n == 0 ? 1 - along : along);
    }
  }
  return neighbors;
}

void FilmLattice::append_points(std::uint32_t triangle, const Eigen::Vector3d& center_O,
                                const Eigen::Vector3d& normal_O, double radius_m,
                                std::vector<FilmPoint>& points) const {
  const Grid& grid = grids_[triangle];
  if (!(grid.height_m > 0)) return;
  const Frame frame = frame_of(triangle, center_O, normal_O, radius_m);
  const double row_step = frame.row_step();
  const double column_step = frame.column_step();
  const RowRange rows = frame.lines_near(0, grid.rows + 1);
  for (std::uint32_t j = rows.first; j < rows.end; ++j) {
    const Row& row = rows_[grid.first_row + j];
    const std::uint32_t count = rows_[grid.first_row + j + 1].first_node - row.first_node;
    // The band of half a step below to half a step above the row is a trapezium: its width at mid-height
    // times its height is its area.
    const double low = std::max(j - .5, 0.) / grid.rows;
    const double high = std::min(j + .5, static_cast<double>(grid.rows)) / grid.rows;
    const double middle = .5 * (low + high);
    const double left = middle * grid.foot_m;
    const double right = left + (1 - middle) * grid.length_m;
    frame.visit_line(j * row_step, row.first_column * column_step, column_step, count,
                     [&](std::uint32_t i, double, double depth) {
                       const double place = (row.first_column + i) * column_step;
                       const double from = std::max(place - .5 * column_step, left);
                       const double to = std::min(place + .5 * column_step, right);
                       if (from >= to || std::abs(depth) > radius_m) return;
                       const double t = (.5 * (from + to) - left) / (right - left);
                       FilmPoint& film_point = points.emplace_back();
                       film_point.point.triangle = triangle;
                       film_point.point.barycentric[grid.apex] = middle;
                       film_point.point.barycentric[(grid.apex + 1) % 3] = (1 - middle) * (1 - t);
                       film_point.point.barycentric[(grid.apex + 2) % 3] = (1 - middle) * t;
                       film_point.position_O = position(mesh_, film_point.point);
                       film_point.area_m2 = (to - from) * (high - low) * grid.height_m;
                       film_point.dose_j_m2 = doses_[row.first_node + i];
                     });
  }
}

}  // namespace hilbrush
