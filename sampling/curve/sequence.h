#pragma once
#include <cstdint>
#include <vector>

#include "sampling/options/sample_options.h"

/// Sequences of numbers in [0, 1), rising: where along the curve's mass the dots go (the thesis,
/// sections 2.1.2 and 4.4).
///
/// jittered      one number at random in each of N equal parts
/// even          the middle of each
/// random        N numbers at random
/// halton        van der Corput's sequence psi_2(k), k = 0 .. N - 1 (equation 2.11)
/// hammersley    k / N: in one dimension a Hammersley set is its first co-ordinate alone
/// sobol         the first dimension of ACM algorithm 659: psi_2 of Gray codes; 100 numbers are dropped
/// niederreiter  the first dimension of ACM algorithm 738 in base 2; 100 numbers are dropped
///
/// In one dimension the last two differ by one step only: the first polynomial of both is x, and algorithm
/// 738 counts from 0 where 659 counts from 1.
namespace hilbrush {

class Sequence {
 public:
  /// `sampler` is one of the above. kRandom keeps its numbers (8 bytes each); the others keep nothing.
  Sequence(Sampler sampler, std::uint64_t count, std::uint64_t seed);

  /// The index-th smallest number. Cost O(1); O(log N) for halton, sobol and niederreiter, whose numbers are
  /// found by counting, digit by digit, how many of the first N share the digits so far.
  double at(std::uint64_t index) const;

 private:
  Sampler sampler_;
  std::uint64_t count_, seed_;
  std::vector<double> sorted_;
};

/// The index-th number of a seed's stream, in [0, 1): a mix of both, so that any thread can have any number.
double uniform_number(std::uint64_t seed, std::uint64_t index);

/// k with its binary digits mirrored at the point: psi_2(k), equation 2.11. Exact for k < 2^53.
double radical_inverse_2(std::uint64_t k);

}  // namespace hilbrush
