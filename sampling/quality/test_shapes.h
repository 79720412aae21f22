#pragma once
#include <tbb/parallel_for.h>

#include <Eigen/Core>
#include <cmath>
#include <span>
#include <vector>

#include "sampling/curve/sequence.h"
#include "sampling/quality/quality.h"

/// Shared by all test shapes: random numbers that do not depend on threads, and the figures of their errors.
namespace hilbrush {

/// The numbers of one shape: number(0), number(1), ... in [0, 1).
class ShapeNumbers {
 public:
  /// `kind` is a number for each kind of shape, so that they do not share their random numbers.
  ShapeNumbers(const TestShapes& shapes, std::uint64_t kind, std::size_t shape)
      : seed_(shapes.seed * 64 + kind), first_(static_cast<std::uint64_t>(shape) * kPerShape) {}
  double operator()(unsigned k) const { return uniform_number(seed_, first_ + k); }

  static constexpr std::uint64_t kPerShape = 16;

 private:
  std::uint64_t seed_, first_;
};

inline Discrepancy discrepancy_of(std::span<const double> errors) {
  Discrepancy result;
  double sum = 0;
  for (const double error : errors) {
    sum += error * error;
    result.largest = std::max(result.largest, std::abs(error));
  }
  if (!errors.empty()) result.rms = std::sqrt(sum / static_cast<double>(errors.size()));
  return result;
}

/// error(i) of all shapes, in parallel; summed up in order.
template <class Error>
Discrepancy measure_shapes(std::size_t count, const Error& error) {
  std::vector<double> errors(count);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) { errors[i] = error(i); });
  return discrepancy_of(errors);
}

}  // namespace hilbrush
