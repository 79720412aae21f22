#pragma once
#include <Eigen/Core>
#include <algorithm>

#include "sampling/blue/stratum_places.h"

/// How dots push each other, and how the surface pulls them.
namespace hilbrush {

/// (1 - r2/R2)^6 within R, a Gaussian of 2 sigma2 = R2/6 but for .04 of its peak: it ends, needs no
/// exponential, and has two smooth derivatives. Its Fourier transform in the plane, J_7(kR)/(kR)^7, nowhere
/// falls below -.003 of its peak: as good as positive, which keeps dots from clumping. Two dots of spacings h
/// and k have sigma2 = kSigma2 (h2 + k2)/2 and the weight 2hk/(h2 + k2): positive definite whatever the
/// spacings (Gibbs, "Bayesian Gaussian Processes", 1997, equation 3.82).
struct PairKernel {
  static constexpr int kExponent = 6;
  /// At unit spacing. Less keeps dots further apart and lets more noise of low frequencies through; more the
  /// reverse.
  static constexpr float kSigma2 = .25f;

  PairKernel(double h, double k)
      : PairKernel(static_cast<float>(h), static_cast<float>(k), static_cast<float>(h * h + k * k)) {}
  PairKernel(float h, float k, float sum2)
      : weight(2 * h * k / sum2),
        support2(static_cast<float>(kExponent) * kSigma2 * sum2),
        inverse_square(1 / support2) {}

  float weight, support2, inverse_square;
};

/// Sums of kernels at all places of a stratum at once.
class PlaceSums {
 public:
  using Sums = Eigen::Array<float, static_cast<int>(kPlacesAStratum), 1>;

  PlaceSums(const PlacedStrata& strata, std::size_t stratum) : middle_O_(strata.strata[stratum].middle_O) {
    for (std::size_t p = 0; p < kPlacesAStratum; ++p) {
      const Eigen::Vector3f place = (strata.place(stratum, p).position_O - middle_O_).cast<float>();
      const auto row = static_cast<Eigen::Index>(p);
      x_[row] = place.x();
      y_[row] = place.y();
      z_[row] = place.z();
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

/// Four places on the surface of a stratum, from its middle, each with the share of the stratum's surface
/// that it stands for (0: none).
struct FourPulls {
  using Numbers = Eigen::Array4f;
  static constexpr std::size_t kCount = 4;

  Numbers x = Numbers::Zero(), y = Numbers::Zero(), z = Numbers::Zero(), share = Numbers::Zero();

  Eigen::Vector3d place(Eigen::Index k) const { return Eigen::Vector3f(x[k], y[k], z[k]).cast<double>(); }
};

/// Gradient and Hessian of a sum of kernels at one place, along two directions of its tangent plane. Kernels
/// are summed four side by side.
class TangentSlope {
 public:
  TangentSlope(const Eigen::Vector3d& place_O, const Eigen::Vector3d& x_O, const Eigen::Vector3d& y_O)
      : place_O_(place_O), x_(x_O.cast<float>()), y_(y_O.cast<float>()) {}

  /// A kernel at `position_O`.
  void add(const PairKernel& kernel, const Eigen::Vector3d& position_O) {
    const Eigen::Vector3f way = (place_O_ - position_O).cast<float>();
    waiting_.row(count_) << way.x(), way.y(), way.z(), kernel.inverse_square, kernel.weight;
    if (++count_ == 4) add_waiting();
  }
  /// Kernels at the places of a stratum, taken off by their shares.
  void subtract(const PairKernel& kernel, const Eigen::Vector3d& middle_O, const FourPulls& pulls) {
    const Eigen::Vector3f way = (place_O_ - middle_O).cast<float>();
    add(way.x() - pulls.x, way.y() - pulls.y, way.z() - pulls.z, Four::Constant(kernel.inverse_square),
        -kernel.weight * pulls.share);
  }

  /// One Newton step, down along both axes of curvature; curvatures nearer to zero than `least` count as that
  /// much.
  Eigen::Vector2f newton_step(float least);

 private:
  using Four = FourPulls::Numbers;

  void add_waiting() {
    add(waiting_.col(0), waiting_.col(1), waiting_.col(2), waiting_.col(3), waiting_.col(4));
    waiting_.setZero();
    count_ = 0;
  }
  void add(const Four& way_x, const Four& way_y, const Four& way_z, const Four& inverse_square,
           const Four& weight) {
    const Four u = (1 - inverse_square * (way_x * way_x + way_y * way_y + way_z * way_z)).max(0.f),
               u2 = u * u;
    const Four x = way_x * x_.x() + way_y * x_.y() + way_z * x_.z();
    const Four y = way_x * y_.x() + way_y * y_.y() + way_z * y_.z();
    const Four u4 = 12 * inverse_square * weight * u2 * u2, first = u4 * u, second = 10 * inverse_square * u4;
    gradient_x_ -= first * x;
    gradient_y_ -= first * y;
    xx_ += second * x * x - first;
    xy_ += second * x * y;
    yy_ += second * y * y - first;
  }

  Eigen::Vector3d place_O_;
  Eigen::Vector3f x_, y_;
  Eigen::Array<float, 4, 5> waiting_ = Eigen::Array<float, 4, 5>::Zero();  ///< way, inverse square, weight
  Eigen::Index count_ = 0;
  Four gradient_x_ = Four::Zero(), gradient_y_ = Four::Zero();
  Four xx_ = Four::Zero(), xy_ = Four::Zero(), yy_ = Four::Zero();
};

}  // namespace hilbrush
