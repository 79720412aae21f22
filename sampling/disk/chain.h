#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

/// The order in which many pieces of surface are walked, and from which corner each.
namespace hilbrush {

/// Which symmetries a piece allows: how it may be laid before it is walked.
enum class Turns : std::uint8_t {
  kNone,
  kMirrors,         ///< of a row of squares: in x and in y
  kMirrorsAndSwap,  ///< of one square: x and y may be swapped too
};

/// A piece for the chain: its curve begins at corner 0 (lower left; then lower right, upper right, upper
/// left) and ends at `end_corner`; the same holds after a symmetry.
struct ChainPiece {
  std::array<Eigen::Vector3d, 4> corners_O;
  std::uint8_t end_corner = 1;
  Turns turns = Turns::kNone;
};

/// A symmetry of a row of squares: first x and y are swapped, then mirrored. It decides in which corner the
/// curve begins; mirrored in x it runs backwards.
struct Symmetry {
  bool is_swapped = false, is_mirrored_x = false, is_mirrored_y = false;

  Eigen::Vector2d operator()(Eigen::Vector2d place, double width) const {
    if (is_swapped) place = {place.y(), place.x()};
    return {is_mirrored_x ? width - place.x() : place.x(), is_mirrored_y ? 1 - place.y() : place.y()};
  }
};

struct ChainLink {
  std::uint32_t piece = 0;
  Symmetry symmetry;
};

/// Begins with piece 0 and continues with the piece that has the nearest corner, and so on; then chooses the
/// symmetries so that the sum of all jumps is least. Cost about O(n log n).
std::vector<ChainLink> chain_pieces(const std::vector<ChainPiece>& pieces);

/// Sum of the jumps from the end of each piece to the beginning of the next.
double total_jump(const std::vector<ChainPiece>& pieces, const std::vector<ChainLink>& chain);

}  // namespace hilbrush
