#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sampling/model/textured_mesh.h"

namespace hilbrush {

/// One spot of light where it landed.
struct Spot {
  Eigen::Vector3d center_O = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction_O = Eigen::Vector3d::UnitZ();  ///< unit, in the direction of the light
  double energy_j = 0;
  double radius_m = 0;  ///< 1/e2, across the beam
};
/// A spot ends at this many 1/e2 radii from its axis; the .3 % of its energy outside are spread over the
/// inside.
inline constexpr double kSpotCutRadii = 1.7;

/// A node of the film and the piece of surface it stands for, by the middle of the piece.
struct FilmPoint {
  SurfacePoint point;
  Eigen::Vector3d position_O = Eigen::Vector3d::Zero();
  double area_m2 = 0;
  double dose_j_m2 = 0;
};

/// The dose on a mesh: one float at each node of a small rectangular grid on each triangle. Rows run along
/// the triangle's longest edge, from there to its apex; rows, and nodes along a row, are at most `spacing`
/// apart. A row keeps the nodes that interpolation inside the triangle needs, which at the border lie just
/// outside, in the triangle's plane. A narrow triangle thus gets as many nodes as its area and border need; a
/// barycentric lattice would have the square of its length. Between nodes the dose is bilinear. Rows are
/// grouped into tiles; different tiles may be exposed by different threads at a time.
class FilmLattice {
 public:
  /// Keeps a reference to `mesh`. @throws InputError if it would take more than kMaxNodes nodes.
  FilmLattice(const TexturedMesh& mesh, double spacing_m);
  static constexpr double kMaxNodes = 600e6;

  /// Appends the tiles of `triangle` that the spot may reach; none if the triangle faces away.
  void append_tiles(std::uint32_t triangle, const Spot& spot, std::vector<std::uint32_t>& tiles) const;
  /// Adds the dose of the spots, in their order, to the nodes of one tile.
  void expose(std::uint32_t tile, std::span<const Spot* const> spots);

  /// The nodes around a point, and their weights there.
  struct Neighbors {
    std::array<float, 4> doses_j_m2;
    std::array<double, 4> weights;
  };
  Neighbors neighbors(const SurfacePoint& point) const;
  /// Divides `triangle` among its nodes, into pieces whose areas add up to its own, and appends the nodes
  /// that lie within radius_m of the axis through center_O along normal_O, and within radius_m of depth.
  void append_points(std::uint32_t triangle, const Eigen::Vector3d& center_O, const Eigen::Vector3d& normal_O,
                     double radius_m, std::vector<FilmPoint>& points) const;

  std::size_t node_count() const { return doses_.size(); }
  std::uint32_t tile_count() const { return static_cast<std::uint32_t>(tile_triangle_.size()); }

 private:
  struct Grid {
    float length_m = 0, height_m = 0,
          foot_m = 0;                     ///< of the longest edge; of the apex above it; of the apex along it
    std::uint32_t columns = 1, rows = 1;  ///< steps, not nodes
    std::uint32_t first_row = 0, first_tile = 0;
    std::uint16_t rows_per_tile = 1;
    std::uint8_t apex = 0;  ///< the corner opposite to the longest edge
  };
  struct Row {
    std::uint32_t first_node, first_column;
  };
  struct Frame;  // a grid seen along an axis
  struct RowRange {
    std::uint32_t first, end;
  };

  Frame frame_of(std::uint32_t triangle, const Eigen::Vector3d& center_O, const Eigen::Vector3d& axis_O,
                 double radius_m) const;

  const TexturedMesh& mesh_;
  std::vector<Grid> grids_;  ///< one a triangle
  std::vector<Row> rows_;    ///< of all triangles, and an end
  std::vector<std::uint32_t> tile_triangle_;
  std::vector<float> doses_;
};

}  // namespace hilbrush
