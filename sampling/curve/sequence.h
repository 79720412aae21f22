#pragma once
#include <cstdint>
#include <vector>

#include "sampling/sample_options.h"

/// Sequences of numbers in [0, 1), rising: where along the curve's mass the dots go.
namespace hilbrush {

class Sequence {
 public:
  /// `sampler` is not kCentroid, which places by area. kRandom keeps its numbers (8 bytes each); the others are
  /// computed.
  Sequence(Sampler sampler, std::uint64_t count, std::uint64_t seed);

  double at(std::uint64_t index) const;

 private:
  Sampler sampler_;
  std::uint64_t count_, seed_;
  std::vector<double> sorted_;
};

/// The index-th number of a seed's stream, in [0, 1): a mix of both, so that any thread can have any number.
double uniform_number(std::uint64_t seed, std::uint64_t index);

}  // namespace hilbrush
