#pragma once
#include <Eigen/Core>
#include <algorithm>

/// Where a curve is inside a quad after a share of its length, for HilbertQuad and PeanoQuad alike.
namespace hilbrush {

/// Place in the unit square after `share` of the curve, to 2^-26 of its side.
template <class Quad>
Eigen::Vector2d place_along(Quad quad, double share) {
  constexpr double kFinest = 0x1p-26;
  Eigen::Vector2d low = Eigen::Vector2d::Zero();
  double size = 1;
  while (size > kFinest) {
    const double f = Quad::kChildCount * share;
    const auto i = static_cast<unsigned>(std::clamp(f, 0., Quad::kChildCount - 1.));
    size /= Quad::kSide;
    low += size * Eigen::Vector2d(quad.place(i) % Quad::kSide, quad.place(i) / Quad::kSide);
    quad = quad.child(i);
    share = std::clamp(f - i, 0., 1.);
  }
  return low + Eigen::Vector2d::Constant(size / 2);
}

/// Integral of that place over the first `share` of the curve.
template <class Quad>
Eigen::Vector2d moment_along(Quad quad, double share) {
  constexpr double kFinest = 0x1p-16;
  Eigen::Vector2d moment = Eigen::Vector2d::Zero(), low = Eigen::Vector2d::Zero();
  double size = 1, weight = 1;  // of the child that the walk is in: side, and share of the curve
  while (size > kFinest) {
    const double f = Quad::kChildCount * share;
    const auto i = static_cast<unsigned>(std::clamp(f, 0., Quad::kChildCount - 1.));
    size /= Quad::kSide;
    weight /= Quad::kChildCount;
    const auto low_of = [&](unsigned place) {
      return Eigen::Vector2d(low + size * Eigen::Vector2d(place % Quad::kSide, place / Quad::kSide));
    };
    for (unsigned k = 0; k < i; ++k) moment += weight * (low_of(quad.place(k)) + Eigen::Vector2d::Constant(size / 2));
    low = low_of(quad.place(i));
    quad = quad.child(i);
    share = std::clamp(f - i, 0., 1.);
  }
  return moment + weight * share * (low + Eigen::Vector2d::Constant(size / 2));
}

}  // namespace hilbrush
