#pragma once
#include <Eigen/Core>

namespace hilbrush {

/// The tone at the four texels around a cell of the grid of texel centers; bilinear between them.
struct CellTones {
  double a, b;  ///< lower row: left and right
  double c, d;  ///< upper row
};

/// Integrals over a polygon in texel coordinates; signed: negative if the polygon runs clockwise.
struct TexelIntegral {
  double mass = 0;                                  ///< of the tone
  Eigen::Vector2d first = Eigen::Vector2d::Zero();  ///< of tone times (x, y)
  double square = 0;                                ///< of the tone squared
};

}  // namespace hilbrush
