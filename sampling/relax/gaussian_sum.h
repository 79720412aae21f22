#pragma once
#include <Eigen/Core>

/// Sums of many Gaussian-like kernels at a place, for dots that push and surface that pulls.
namespace hilbrush {

/// (1 - r2 / R2)^6 within R, a Gaussian of 2 sigma2 = R2 / 6 but for .04 of its peak: it ends, needs no exponential and
/// has two smooth derivatives. Its Fourier transform in the plane, J_7(kR) / (kR)^7, nowhere falls below -.003 of its
/// peak: as good as positive, which is what keeps dots from clumping.
class GaussianSum {
 public:
  static constexpr double kExponent = 6;

  void clear() { size_ = 0; }
  /// A kernel of this weight at `place`; inverse_square is 1/R2.
  void add(const Eigen::Vector3f& place, float inverse_square, float weight) {
    if (size_ == columns_.cols()) columns_.conservativeResize(Eigen::NoChange, 2 * size_ + 64);
    columns_.col(size_++) << place.x(), place.y(), place.z(), inverse_square, weight;
  }

  float operator()(const Eigen::Vector3f& p) const {
    float sum = 0;
    for (Eigen::Index i = 0; i < size_; ++i) {
      const float* c = columns_.data() + kRows * i;
      const float x = p.x() - c[0], y = p.y() - c[1], z = p.z() - c[2];
      const float u = std::max(0.f, 1 - c[3] * (x * x + y * y + z * z)), u2 = u * u;
      sum += c[4] * u2 * u2 * u2;
    }
    return sum;
  }

  /// Gradient and Hessian along x and y.
  struct Slope {
    Eigen::Vector2f gradient = Eigen::Vector2f::Zero();
    float xx = 0, xy = 0, yy = 0;
  };
  Slope slope(const Eigen::Vector3f& p) const {
    Slope s;
    for (Eigen::Index i = 0; i < size_; ++i) {
      const float* c = columns_.data() + kRows * i;
      const float x = p.x() - c[0], y = p.y() - c[1], z = p.z() - c[2];
      const float u = std::max(0.f, 1 - c[3] * (x * x + y * y + z * z)), u2 = u * u;
      const float first = 12 * c[3] * c[4] * u2 * u2 * u, second = 120 * c[3] * c[3] * c[4] * u2 * u2;
      s.gradient.x() -= first * x;
      s.gradient.y() -= first * y;
      s.xx += second * x * x - first;
      s.xy += second * x * y;
      s.yy += second * y * y - first;
    }
    return s;
  }

 private:
  static constexpr int kRows = 5;
  Eigen::Matrix<float, kRows, Eigen::Dynamic> columns_;
  Eigen::Index size_ = 0;
};

}  // namespace hilbrush
