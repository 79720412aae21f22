#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "sampling/curve/hilbert.h"
#include "sampling/curve/peano.h"
#include "sampling/curve/piece.h"
#include "sampling/model/textured_mesh.h"

/// A chart is a part of the surface that one curve walks: a component, or a piece of one, on the unit square
/// or in space. Its base tree is divided until a quad (in space: a cube) holds few triangles and little area;
/// everything finer is made again on each walk and not kept.
namespace hilbrush {

/// What the curve of a chart fills: the square, or a row of squares, or a cube.
enum class ChartKind : std::uint8_t { kHilbertSquare, kPeanoSquare, kHilbertCube };

template <class Curve>
inline constexpr int kDimensionsOf = Curve::kChildCount == 8 ? 3 : 2;

/// A leaf of the base tree.
struct BaseQuad {
  Eigen::Vector3d low = Eigen::Vector3d::Zero();  ///< z = 0 on the square
  double size = 1;
  std::uint32_t first_face = 0;  ///< in Chart::face_lists
  std::uint32_t face_count = 0;
  std::uint8_t permutation = 0;  ///< this and cube_direction: how the curve runs in it, see curve_of()
  std::uint8_t cube_direction = 0;
  std::uint8_t depth = 0;
};

template <class Curve>
Curve curve_of(const BaseQuad& quad) {
  if constexpr (kDimensionsOf<Curve> == 3)
    return Curve(quad.permutation, quad.cube_direction);
  else
    return Curve(quad.permutation);
}

/// A mesh triangle on the square, or one of the parts that the map has split it into.
struct ChartFace {
  static constexpr std::uint32_t kWhole = ~std::uint32_t{0};
  std::uint32_t triangle = 0;
  std::uint32_t part = kWhole;  ///< else an index into Chart::parts
  /// The corners on the square; not used in space.
  std::array<Eigen::Vector2d, 3> places{Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero(),
                                        Eigen::Vector2d::Zero()};
};

struct Chart {
  std::uint32_t component = 0;
  ChartKind kind = ChartKind::kHilbertSquare;
  int square_count = 1;  ///< squares in a row; each is walked so that it ends where the next one begins
  std::vector<ChartFace> faces;
  std::vector<std::array<Eigen::Vector2d, 3>> parts;  ///< corners by second and third barycentric coordinate
  std::vector<std::uint32_t> face_lists;
  std::vector<BaseQuad> base_quads;  ///< in order of the curve; empty ones are left out

  const ChartFace& face_of(const BaseQuad& quad, std::uint32_t i) const {
    return faces[face_lists[quad.first_face + i]];
  }
  /// A face's corners by second and third barycentric coordinate.
  std::array<Eigen::Vector2d, 3> corners_b(const ChartFace& face) const {
    if (face.part != ChartFace::kWhole) return parts[face.part];
    return {Eigen::Vector2d(0, 0), Eigen::Vector2d(1, 0), Eigen::Vector2d(0, 1)};
  }
};

/// Calls `visit` with the chart's kind of curve.
template <class Visit>
decltype(auto) with_curve(ChartKind kind, Visit visit) {
  switch (kind) {
    case ChartKind::kPeanoSquare:
      return visit(PeanoQuad{});
    case ChartKind::kHilbertCube:
      return visit(HilbertCube{});
    case ChartKind::kHilbertSquare:
      break;
  }
  return visit(HilbertQuad{});
}

/// A face as a piece, with its corners on the square (2) or in space (3).
template <int kDimensions>
Piece<kDimensions> whole_piece(const Chart& chart, const TexturedMesh& mesh, const ChartFace& face);

/// Cuts a piece to a box; the rest may be empty.
template <int kDimensions>
void clip_to_box(Piece<kDimensions>& piece, const Eigen::Matrix<double, kDimensions, 1>& low, double size);

/// Builds the base tree of a chart that has its faces; `mesh_area_m2` is the whole mesh's area, which a
/// caller with many charts sums once. Cost O(faces log faces). On the square it gives up and returns false if
/// the map is so sheared that the quads would hold each triangle many times.
bool build_base_tree(Chart& chart, const TexturedMesh& mesh, double mesh_area_m2);

}  // namespace hilbrush
