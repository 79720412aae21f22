#pragma once
#include <array>
#include <cstddef>

#include "sampling/tone/texel_integral.h"

/// Integrals of a bilinear tone over a polygon, as sums over straight pieces of its boundary (Green's
/// theorem), each piece within one cell of the grid of texel centers. Along a piece the integrands are
/// polynomials of degree at most 5: Gauss's three places are exact. Pieces are gathered and summed four side
/// by side.
namespace hilbrush {

/// Integrals along x, from the column where the polygon begins to the left side of a cell, of f (the tone on
/// the row's lower side), g (on its upper side) and their products.
struct RowSums {
  double f, g, xf, xg, ff, fg, gg;
};

/// What a piece of the boundary needs to know of its cell.
struct BoundaryCell {
  double left, low;  ///< its lower left corner
  CellTones tones;
  RowSums sums;
};

class BoundarySum {
 public:
  /// A piece that begins at (s, t), from the cell's lower left corner, and goes (ds, dt). `cell` has to stay
  /// until the sum is taken or kMax more pieces are added.
  void add(double s, double t, double ds, double dt, const BoundaryCell& cell) {
    if (count_ == kMax) flush();
    pieces_.s[count_] = s, pieces_.t[count_] = t, pieces_.ds[count_] = ds, pieces_.dt[count_] = dt;
    pieces_.cells[count_++] = &cell;
  }

  /// Of all pieces so far.
  TexelIntegral total() {
    flush();
    return total_;
  }

  static constexpr std::size_t kLanes = 4, kMax = 32;
  struct Pieces {
    using Numbers = std::array<double, kMax>;
    alignas(32) Numbers s, t, ds, dt;
    std::array<const BoundaryCell*, kMax> cells;
  };

 private:
  /// Adds up what is gathered.
  void flush();

  std::size_t count_ = 0;
  Pieces pieces_;
  TexelIntegral total_;
};

}  // namespace hilbrush
