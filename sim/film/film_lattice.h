#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "sampling/textured_mesh.h"

namespace hilbrush {

/// One spot of light where it landed.
struct Spot {
  Eigen::Vector3d center_O = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction_O = Eigen::Vector3d::UnitZ();  ///< unit, the way the light travels
  double energy_j = 0;
  double radius_m = 0;  ///< 1/e2, across the beam
};
/// Light is followed to this many 1/e2 radii from the axis; the .3 % outside is spread over the inside.
inline constexpr double kSpotCutRadii = 1.7;

/// A lattice point of the film and the surface it stands for.
struct FilmPoint {
  SurfacePoint point;
  Eigen::Vector3d position_O = Eigen::Vector3d::Zero();
  double area_m2 = 0;
  double dose_j_m2 = 0;
};

/// The dose on a mesh: one float at each point of a small lattice on each triangle. A triangle's rows run along its
/// longest edge, from there to the apex, and are `spacing` apart at most, as are the points along a row: a needle gets
/// as many points as its area and border need, where a lattice of equal steps in all three directions would get the
/// square of its length. Between points the dose is interpolated linearly. Rows are grouped into tiles; different tiles
/// may be exposed by different threads at a time.
class FilmLattice {
 public:
  /// Keeps a reference to `mesh`. @throws InputError if it would take more than kPointLimit points.
  FilmLattice(const TexturedMesh& mesh, double spacing_m);
  static constexpr double kPointLimit = 600e6;

  /// Appends the tiles of `triangle` that the spot may reach; none if the triangle faces away.
  void append_tiles(std::uint32_t triangle, const Spot& spot, std::vector<std::uint32_t>& tiles) const;
  /// Adds the dose of the spots, in their order, to the points of one tile.
  void expose(std::uint32_t tile, std::span<const Spot* const> spots);

  double dose_j_m2(const SurfacePoint& point) const;
  /// Appends the points of `triangle` within radius_m of the axis through center_O along normal_O, and within radius_m
  /// of depth.
  void append_points(std::uint32_t triangle, const Eigen::Vector3d& center_O, const Eigen::Vector3d& normal_O,
                     double radius_m, std::vector<FilmPoint>& points) const;

  std::size_t point_count() const { return doses_.size(); }
  std::uint32_t tile_count() const { return tile_count_; }

 private:
  struct Grid {
    std::uint32_t first_row = 0, first_tile = 0;
    std::uint32_t row_steps = 1, base_steps = 1;  ///< rows - 1; points in row 0 - 1
    std::uint16_t rows_per_tile = 1;
    std::uint8_t apex = 0;  ///< the corner opposite to the longest edge
  };
  struct Frame;  // a grid seen across a beam
  struct RowRange {
    std::uint32_t first, end;
  };

  std::uint32_t steps_of_row(const Grid& grid, std::uint32_t row) const {
    const std::uint64_t rows_left = grid.row_steps - row;
    return static_cast<std::uint32_t>((grid.base_steps * rows_left + grid.row_steps - 1) / grid.row_steps);
  }
  const Eigen::Vector3d& corner(std::uint32_t triangle, const Grid& grid, int c) const {
    return mesh_.corner(triangle, (grid.apex + c) % 3);
  }
  double row_area_share(const Grid& grid, std::uint32_t row) const;
  double dose_on_row(const Grid& grid, std::uint32_t row, double along) const;
  template <class Visit>
  void visit_points(std::uint32_t triangle, const Frame& frame, RowRange rows, Visit visit) const;

  const TexturedMesh& mesh_;
  std::vector<Grid> grids_;                 ///< one a triangle
  std::vector<std::uint32_t> first_point_;  ///< of each row of all triangles
  std::vector<std::uint32_t> tile_triangle_;
  std::vector<float> doses_;
  std::uint32_t tile_count_ = 0;
};

}  // namespace hilbrush
