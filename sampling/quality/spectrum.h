#pragma once
#include "sampling/quality/quality.h"

namespace hilbrush {

/// Sums up powers by ring and direction. Frequencies are over the principal frequency.
class SpectrumSums {
 public:
  static constexpr double kHighest = 2;  ///< times the principal frequency

  SpectrumSums(std::size_t ring_count, std::size_t direction_count);

  void add(const Eigen::Vector2d& frequency, double power);
  Spectrum result() const;

 private:
  struct Sum {
    double count = 0;
    double power = 0;
    double square = 0;

    void add(double p) {
      count += 1;
      power += p;
      square += p * p;
    }
    double mean() const { return count > 0 ? power / count : 0; }
  };
  std::vector<Sum> rings_, directions_;
  Sum half_, quarter_;
};

/// Calculates the peak and the anisotropy of a spectrum from its rings and directions.
void complete_spectrum(Spectrum& spectrum);

}  // namespace hilbrush
