#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "sampling/tone/texel_addressing.h"
#include "sampling/tone/texel_integral.h"

/// A tone picture that can be looked up at a point and integrated exactly over a polygon, both with the same
/// bilinear interpolation and the same addressing. Coordinates are texels: texel (i, j) has its center at (i,
/// j).
namespace hilbrush {

class ToneLayer {
 public:
  /// `tones` has width * height values, row by row.
  ToneLayer(int width, int height, std::vector<float> tones);

  int width() const { return width_; }
  int height() const { return height_; }
  double mean() const { return mean_; }

  double at(const Eigen::Vector2d& point, TexelAddressing addressing) const;

  /// Exact but for rounding, by Green's theorem: the boundary is cut at every row and column of texels, and
  /// on each piece the sum of the row so far is a polynomial. Cost O(texels on the boundary), each row's sum
  /// from its blocks.
  TexelIntegral integrate(std::span<const Eigen::Vector2d> polygon, TexelAddressing addressing) const;

 private:
  class WindowCells;
  class WalkedCells;

  static TexelIntegral integrate_in_cell(std::span<const Eigen::Vector2d> polygon, const CellTones& tones,
                                         const Eigen::Vector2d& origin);
  const float* row(std::int64_t row, TexelAddressing addressing) const;

  /// Integrals along a row from texel 0, of the tone, of x times it, of its square, and of its product with
  /// the row above.
  struct RowPrefix {
    double f = 0, xf = 0, ff = 0, fg = 0;
  };
  static constexpr int kBlock = 16;  ///< texels between two stored prefixes: two bytes a texel

  void add_column(RowPrefix& prefix, int row, int column) const;
  RowPrefix prefix(int row, int column) const;
  /// Of a row that goes on repeating: prefix to any column.
  RowPrefix repeated_prefix(int row, std::int64_t column) const;

  int width_ = 0, height_ = 0;
  int blocks_ = 0;  ///< prefixes a row
  double mean_ = 0;
  std::vector<float> tones_;
  std::vector<RowPrefix> prefixes_;
};

}  // namespace hilbrush
