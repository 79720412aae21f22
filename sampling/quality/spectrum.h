#pragma once
#include "sampling/quality/quality.h"

namespace hilbrush {

/// Collects powers, each at a frequency vector over the principal frequency, and sums them up.
class SpectrumSums {
 public:
  static constexpr double kHighest = 2;  ///< times the principal frequency

  SpectrumSums(std::size_t ring_count, std::size_t direction_count);

  void add(const Eigen::Vector2d& frequency, double power);
  Spectrum result() const;

 private:
  struct Sum {
    double count = 0, power = 0, square = 0;
    void add(double p) { count += 1, power += p, square += p * p; }
    double mean() const { return count > 0 ? power / count : 0; }
  };
  std::vector<Sum> rings_, directions_;
  Sum half_, quarter_;
};

/// Peak and anisotropy of a spectrum follow from its rings and directions.
void complete_spectrum(Spectrum& spectrum);

}  // namespace hilbrush
