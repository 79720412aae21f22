#pragma once
#include <vector>

#include "sampling/curve/hilbert.h"
#include "sampling/curve/piece.h"
#include "sampling/progress.h"

/// A sheet is a stretch of the surface that one Hilbert curve walks: a component on the unit square, or a component in
/// space. Its base tree is divided until a quad (in space: a cube) holds few triangles; everything finer is made anew
/// on each walk and not kept.
namespace hilbrush {

/// A quad or a cube of the tree.
struct Box {
  Eigen::Vector3d low = Eigen::Vector3d::Zero();
  double size = 1;

  Eigen::Vector3d middle() const { return low + Eigen::Vector3d::Constant(size / 2); }
  Box child(unsigned place) const;
};

/// A leaf of the base tree.
struct BaseQuad {
  Box box;
  HilbertQuad quad;                              ///< how the curve runs in it, on the square ...
  HilbertCube cube;                              ///< ... or in space
  std::uint32_t first_face = 0, face_count = 0;  ///< in Sheet::face_lists
};

struct SheetFace {
  std::uint32_t triangle = 0;
  std::array<PieceCorner, 3> corners;
};

struct Sheet {
  std::uint32_t component = 0;
  bool is_on_square = false;
  int square_count = 1;  ///< squares in a row, each walked from its lower left to its lower right corner
  std::vector<SheetFace> faces;
  std::vector<std::uint32_t> face_lists;
  std::vector<BaseQuad> base_quads;  ///< in order of the curve; empty ones are left out
  Eigen::Vector3d begin_O = Eigen::Vector3d::Zero(),
                  end_O = Eigen::Vector3d::Zero();  ///< where the curve starts and ends

  /// The faces of a base quad, cut to its box.
  void pieces_of(const BaseQuad& quad, std::vector<Piece>& pieces) const;
};

/// Fills in the base tree of a sheet whose faces are there. Cost O(faces log faces). On the square it gives up and
/// returns false if the map is so sheared that the quads would hold each triangle many times.
bool build_base_tree(Sheet& sheet, const TexturedMesh& mesh);

/// Orders sheets so that the jump from the end of one to the beginning of the next is short; the first stays first.
std::vector<std::uint32_t> chain_sheets(const std::vector<Sheet>& sheets);

}  // namespace hilbrush
