#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

/// A tone picture that can be looked up at a point and integrated exactly over a polygon, both with the same bilinear
/// interpolation and the same addressing. Coordinates are texels: texel (i, j) has its centre at (i, j).
namespace hilbrush {

struct TexelAddressing {
  bool repeat_x = true, repeat_y = true;  ///< else the border texels go on for ever
};

/// Integrals over a polygon in texel coordinates; signed: negative if the polygon runs clockwise.
struct TexelIntegral {
  double area = 0;
  double mass = 0;                                  ///< of the tone
  Eigen::Vector2d first = Eigen::Vector2d::Zero();  ///< of tone times (x, y)
  double square = 0;                                ///< of the tone squared
};

class ToneLayer {
 public:
  /// `tones` has width * height values, row by row.
  ToneLayer(int width, int height, std::vector<float> tones);

  int width() const { return width_; }
  int height() const { return height_; }
  double mean() const { return mean_; }

  double at(const Eigen::Vector2d& point, TexelAddressing addressing) const;

  /// Exact but for rounding, by Green's theorem: the boundary is cut at every row and column of texels, and on each
  /// piece the sum of the row so far is a polynomial. Cost O(texels on the boundary), each row's sum from its blocks.
  TexelIntegral integrate(std::span<const Eigen::Vector2d> polygon, TexelAddressing addressing) const;

 private:
  class BoundaryWalk;

  int width_ = 0, height_ = 0;
  double mean_ = 0;
  std::vector<float> tones_;
};

}  // namespace hilbrush
