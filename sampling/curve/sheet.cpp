#include "sampling/curve/sheet.h"

#include <algorithm>
#include <limits>

namespace hilbrush {
namespace {

constexpr std::size_t kMostFaces = 8;
/// A quad with no more than a small share of a mean triangle's area may hold as many: around a vertex with many
/// triangles, and along needles, division would not end by itself.
constexpr std::size_t kMostFacesIfSmall = 64;
constexpr double kSmallShare = .25;
/// The same holds where the children together would have this many times the triangles.
constexpr double kTooManyInChildren = 1.9;
constexpr int kDeepest = 24;
/// A sound map lists each face in a few quads.
constexpr std::size_t kMostListed = 100'000, kMostListedPerFace = 60;
/// Chaining by nearest ends is quadratic.
constexpr std::size_t kMostChained = 3000;

Piece whole(const SheetFace& face, std::uint32_t index) {
  Piece piece;
  piece.triangle = index;
  for (const PieceCorner& corner : face.corners) piece.add(corner);
  return piece;
}

/// While the base tree is built, Piece::triangle is the face's index.
bool is_base_leaf(const Sheet& sheet, const TexturedMesh& mesh, double small_area, int depth,
                  const std::vector<Piece>& pieces) {
  if (pieces.size() <= kMostFaces || depth == kDeepest) return true;
  if (pieces.size() > kMostFacesIfSmall) return false;
  double area = 0;
  for (const Piece& piece : pieces)
    area += 2 * area_b(piece) * mesh.area_vector(sheet.faces[piece.triangle].triangle).norm();
  return area < small_area;
}

template <class Hilbert>
void add_base_quad(Sheet& sheet, const Box& box, Hilbert hilbert, const std::vector<Piece>& pieces) {
  BaseQuad quad;
  quad.box = box;
  quad.first_face = static_cast<std::uint32_t>(sheet.face_lists.size());
  quad.face_count = static_cast<std::uint32_t>(pieces.size());
  if constexpr (Hilbert::kChildCount == 4)
    quad.quad = hilbert;
  else
    quad.cube = hilbert;
  for (const Piece& piece : pieces) sheet.face_lists.push_back(piece.triangle);
  sheet.base_quads.push_back(quad);
}

bool is_out_of_bounds(const Sheet& sheet) {
  return sheet.face_lists.size() > kMostListed + kMostListedPerFace * sheet.faces.size();
}

template <class Hilbert>
void divide(Sheet& sheet, const TexturedMesh& mesh, double small_area, const Box& box, Hilbert hilbert, int depth,
            std::vector<Piece>& pieces) {
  if (pieces.empty()) return;
  const bool is_too_much = is_out_of_bounds(sheet);
  if (is_too_much && Hilbert::kChildCount == 4) return;
  if (is_too_much || is_base_leaf(sheet, mesh, small_area, depth, pieces))
    return add_base_quad(sheet, box, hilbert, pieces);
  auto children = cut_into_children<Hilbert::kChildCount>(pieces, box.middle());
  std::size_t count = 0;
  for (const auto& child : children) count += child.size();
  if (pieces.size() <= kMostFacesIfSmall &&
      static_cast<double>(count) > kTooManyInChildren * static_cast<double>(pieces.size()))
    return add_base_quad(sheet, box, hilbert, pieces);
  std::vector<Piece>().swap(pieces);
  for (unsigned i = 0; i < Hilbert::kChildCount; ++i) {
    const unsigned place = hilbert.place(i);
    divide(sheet, mesh, small_area, box.child(place), hilbert.child(i), depth + 1, children[place]);
  }
}

Box bounding_cube(const Sheet& sheet) {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (const SheetFace& face : sheet.faces)
    for (const PieceCorner& corner : face.corners) {
      low = low.cwiseMin(corner.place);
      high = high.cwiseMax(corner.place);
    }
  const double size = (high - low).maxCoeff() * (1 + 1e-9);
  return {.5 * (low + high) - Eigen::Vector3d::Constant(size / 2), size};
}

Eigen::Vector3d position_of_first_piece(const Sheet& sheet, const BaseQuad& quad, const TexturedMesh& mesh) {
  std::vector<Piece> pieces;
  sheet.pieces_of(quad, pieces);
  if (pieces.empty()) return Eigen::Vector3d::Zero();
  const Eigen::Vector2d b = pieces[0].corners[0].b;
  return position(mesh, {pieces[0].triangle, {1 - b.x() - b.y(), b.x(), b.y()}});
}

}  // namespace

Box Box::child(unsigned place) const {
  Box result{low, size / 2};
  for (int k = 0; k < 3; ++k)
    if (place >> k & 1u) result.low[k] += size / 2;
  return result;
}

void Sheet::pieces_of(const BaseQuad& quad, std::vector<Piece>& pieces) const {
  pieces.clear();
  const int dimensions = is_on_square ? 2 : 3;
  for (std::uint32_t i = 0; i < quad.face_count; ++i) {
    const SheetFace& face = faces[face_lists[quad.first_face + i]];
    Piece inside = whole(face, face.triangle), outside, kept;
    for (int axis = 0; axis < dimensions; ++axis) {
      cut_piece(inside, axis, quad.box.low[axis], outside, kept);
      cut_piece(kept, axis, quad.box.low[axis] + quad.box.size, inside, outside);
    }
    if (inside.corner_count >= 3 && area_b(inside) > 0) pieces.push_back(inside);
  }
}

bool build_base_tree(Sheet& sheet, const TexturedMesh& mesh) {
  std::vector<Piece> pieces;
  pieces.reserve(sheet.faces.size());
  double area = 0;
  for (std::uint32_t f = 0; f < sheet.faces.size(); ++f) {
    pieces.push_back(whole(sheet.faces[f], f));
    area += 2 * area_b(pieces.back()) * mesh.area_vector(sheet.faces[f].triangle).norm();
  }
  const double small_area = kSmallShare * area / static_cast<double>(std::max<std::size_t>(1, pieces.size()));
  if (!sheet.is_on_square) {
    divide(sheet, mesh, small_area, bounding_cube(sheet), HilbertCube{}, 0, pieces);
  } else {
    for (int i = 1; i <= sheet.square_count; ++i) {
      std::vector<Piece> rest, here;
      Piece left, right;
      for (const Piece& piece : pieces) {
        if (i == sheet.square_count) {
          here.push_back(piece);
          continue;
        }
        cut_piece(piece, 0, i, left, right);
        if (left.corner_count >= 3 && area_b(left) > 0) here.push_back(left);
        if (right.corner_count >= 3 && area_b(right) > 0) rest.push_back(right);
      }
      const Box square{Eigen::Vector3d(i - 1, 0, 0), 1};
      divide(sheet, mesh, small_area, square, HilbertQuad{}, 0, here);
      pieces = std::move(rest);
    }
  }
  if (sheet.is_on_square && is_out_of_bounds(sheet)) return false;
  if (sheet.base_quads.empty()) return true;
  sheet.begin_O = position_of_first_piece(sheet, sheet.base_quads.front(), mesh);
  sheet.end_O = position_of_first_piece(sheet, sheet.base_quads.back(), mesh);
  return true;
}

std::vector<std::uint32_t> chain_sheets(const std::vector<Sheet>& sheets) {
  std::vector<std::uint32_t> chain(sheets.size());
  for (std::uint32_t i = 0; i < chain.size(); ++i) chain[i] = i;
  if (chain.size() > kMostChained) return chain;
  for (std::size_t i = 1; i < chain.size(); ++i) {
    const Eigen::Vector3d& here = sheets[chain[i - 1]].end_O;
    const auto next = std::min_element(
        chain.begin() + static_cast<std::ptrdiff_t>(i), chain.end(), [&](std::uint32_t a, std::uint32_t b) {
          return (sheets[a].begin_O - here).squaredNorm() < (sheets[b].begin_O - here).squaredNorm();
        });
    std::iter_swap(chain.begin() + static_cast<std::ptrdiff_t>(i), next);
  }
  return chain;
}

}  // namespace hilbrush
