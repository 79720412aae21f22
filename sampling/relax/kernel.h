#pragma once
#include <Eigen/Core>
#include <algorithm>

#include "sampling/relax/stratum_places.h"

/// How dots push each other, and how the surface pulls them.
namespace hilbrush {

/// (1 - r2/R2)^6 within R, a Gaussian of 2 sigma2 = R2/6 but for .04 of its peak: it ends, needs no exponential, and
/// has two smooth derivatives. Its Fourier transform in the plane, J_7(kR)/(kR)^7, nowhere falls below -.003 of its
/// peak: as good as positive, which keeps dots from clumping. Two dots of spacings h and k have sigma2 = kSigma2 (h2 +
/// k2)/2 and the weight 2hk/(h2 + k2): positive definite whatever the spacings (Gibbs, "Bayesian Gaussian Processes",
/// 1997, equation 3.82).
struct PairKernel {
  static constexpr int kExponent = 6;
  /// At unit spacing. Less keeps dots further apart and lets more noise of low frequencies through; more the reverse.
  static constexpr float kSigma2 = .25f;

  PairKernel(double h, double k)
      : PairKernel(static_cast<float>(h), static_cast<float>(k), static_cast<float>(h * h + k * k)) {}
  PairKernel(float h, float k, float sum2)
      : weight(2 * h * k / sum2), inverse_square(1 / (static_cast<float>(kExponent) * kSigma2 * sum2)) {}

  double support2() const { return 1. / static_cast<double>(inverse_square); }

  float weight, inverse_square;
};

/// Sums of kernels at all places of a stratum at a time.
class PlaceSums {
 public:
  using Sums = Eigen::Array<float, static_cast<int>(kPlacesAStratum), 1>;

  PlaceSums(const PlacedStrata& strata, std::size_t stratum) : middle_O_(strata.strata[stratum].middle_O) {
    for (std::size_t p = 0; p < kPlacesAStratum; ++p) {
      const Eigen::Vector3f place = (strata.place(stratum, p).position_O - middle_O_).cast<float>();
      const auto row = static_cast<Eigen::Index>(p);
      x_[row] = place.x(), y_[row] = place.y(), z_[row] = place.z();
    }
  }
  /// A kernel at `position_O`, `factor` times its weight.
  void add(const PairKernel& kernel, const Eigen::Vector3d& position_O, float factor) {
    const Eigen::Vector3f at = (position_O - middle_O_).cast<float>();
    const Sums r2 = (x_ - at.x()).square() + (y_ - at.y()).square() + (z_ - at.z()).square();
    const Sums u2 = (1 - kernel.inverse_square * r2).max(0.f).square();
    sums_ += factor * kernel.weight * u2 * u2 * u2;
  }
  const Sums& sums() const { return sums_; }

 private:
  Eigen::Vector3d middle_O_;
  Sums x_, y_, z_, sums_ = Sums::Zero();
};

/// Gradient and Hessian of a sum of kernels at one place, along two directions of its tangent plane.
class TangentSlope {
 public:
  TangentSlope(const Eigen::Vector3d& place_O, const Eigen::Vector3d& x_O, const Eigen::Vector3d& y_O)
      : place_O_(place_O), x_(x_O.cast<float>()), y_(y_O.cast<float>()) {}

  void add(const PairKernel& kernel, const Eigen::Vector3d& position_O, float factor) {
    const Eigen::Vector3f way = (place_O_ - position_O).cast<float>();
    const float u = 1 - kernel.inverse_square * way.squaredNorm();
    if (!(u > 0)) return;
    const float x = way.dot(x_), y = way.dot(y_), u4 = u * u * u * u;
    const float second = 120 * kernel.inverse_square * kernel.inverse_square * factor * kernel.weight * u4;
    const float first = second * u / (10 * kernel.inverse_square);
    gradient_.x() -= first * x;
    gradient_.y() -= first * y;
    xx_ += second * x * x - first;
    xy_ += second * x * y;
    yy_ += second * y * y - first;
  }

  /// One Newton step, down along both axes of curvature; curvatures nearer to zero than `least` count as that much.
  Eigen::Vector2f newton_step(float least) const;

 private:
  Eigen::Vector3d place_O_;
  Eigen::Vector3f x_, y_;
  Eigen::Vector2f gradient_ = Eigen::Vector2f::Zero();
  float xx_ = 0, xy_ = 0, yy_ = 0;
};

}  // namespace hilbrush
