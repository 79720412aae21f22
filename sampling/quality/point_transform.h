#pragma once
#include <Eigen/Core>
#include <complex>
#include <span>
#include <vector>

/// Fourier transforms of points in the unit square.
namespace hilbrush {

/// sum_j exp(-2 pi i (kx, ky) . x_j) for whole kx of 0..highest and ky of -highest..highest.
class PointTransform {
 public:
  /// Spreads the points on a grid of at least twice the resolution with a Kaiser-Bessel kernel eight knots
  /// wide, transforms the grid and divides by the kernel's own transform (Fessler and Sutton 2003). Error
  /// below 1e-6 of the root of the number of points. Cost O(n + highest^2 log highest).
  PointTransform(std::span<const Eigen::Vector2d> points, int highest);

  int highest() const { return highest_; }
  std::complex<double> at(int kx, int ky) const {
    return values_[static_cast<std::size_t>(kx) * (2 * static_cast<std::size_t>(highest_) + 1) +
                   static_cast<std::size_t>(ky + highest_)];
  }

 private:
  int highest_;
  std::vector<std::complex<double>> values_;  ///< by kx, then ky
};

}  // namespace hilbrush
