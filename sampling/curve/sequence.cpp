#include "sampling/curve/sequence.h"

#include <algorithm>

#include "sampling/base/check.h"
#include "sampling/base/random.h"

namespace hilbrush {
namespace {

/// The thesis drops as many of Sobol's and Niederreiter's numbers "to avoid the leading zeros phenomenon".
constexpr std::uint64_t kDropped = 100;

constexpr std::uint64_t low_bits(int count) {
  return (std::uint64_t{1} << count) - 1;
}

/// A range of whole numbers, counted by their low digits.
struct Range {
  std::uint64_t begin, end;

  /// How many are `residue` modulo 2^digits.
  std::uint64_t count(std::uint64_t residue, int digits) const {
    const std::uint64_t gap = low_bits(digits) - residue;
    return ((end + gap) >> digits) - ((begin + gap) >> digits);
  }
  /// The first that is.
  std::uint64_t first(std::uint64_t residue, int digits) const {
    const std::uint64_t gap = low_bits(digits) - residue;
    return ((begin + gap) >> digits << digits) + residue;
  }
};

/// The index-th smallest of psi_2(k) over the range. The first digit of psi_2(k) is the last of k, so the
/// numbers that begin alike are the k of one residue.
double ranked(const Range& range, std::uint64_t index) {
  std::uint64_t residue = 0;
  int digits = 0;
  for (std::uint64_t left = range.end - range.begin; left > 1;) {
    const std::uint64_t lower = range.count(residue, digits + 1);
    if (index < lower) {
      left = lower;
    } else {
      index -= lower;
      left -= lower;
      residue |= std::uint64_t{1} << digits;
    }
    ++digits;
  }
  return radical_inverse_2(range.first(residue, digits));
}

std::uint64_t gray(std::uint64_t k) {
  return k ^ (k >> 1);
}

/// The same of psi_2(gray(k)). The last `digits` digits of gray(k) are those of two residues of k modulo
/// 2^(digits + 1), each the other's complement; `residue` is the one whose highest digit is 0.
double ranked_gray(const Range& range, std::uint64_t index) {
  std::uint64_t residue = 0;
  int digits = 0;
  for (std::uint64_t left = range.end - range.begin; left > 1;) {
    ++digits;
    const std::uint64_t lower =
        range.count(residue, digits + 1) + range.count(low_bits(digits + 1) ^ residue, digits + 1);
    if (index < lower) {
      left = lower;
    } else {
      index -= lower;
      left -= lower;
      residue ^= low_bits(digits);
    }
  }
  const std::uint64_t first = range.first(residue, digits + 1);
  return radical_inverse_2(
      gray(first < range.end ? first : range.first(low_bits(digits + 1) ^ residue, digits + 1)));
}

}  // namespace

double uniform_number(std::uint64_t seed, std::uint64_t index) {
  return unit_interval(mix_bits(splitmix64(seed) + kGoldenGamma * (index + 1)));
}

double radical_inverse_2(std::uint64_t k) {
  k = ((k >> 1) & 0x5555555555555555u) | ((k & 0x5555555555555555u) << 1);
  k = ((k >> 2) & 0x3333333333333333u) | ((k & 0x3333333333333333u) << 2);
  k = ((k >> 4) & 0x0f0f0f0f0f0f0f0fu) | ((k & 0x0f0f0f0f0f0f0f0fu) << 4);
  return static_cast<double>(__builtin_bswap64(k)) * 0x1p-64;
}

Sequence::Sequence(Sampler sampler, std::uint64_t count, std::uint64_t seed)
    : sampler_(sampler), count_(count), seed_(seed) {
  CHECK(sampler != Sampler::kCentroid && sampler != Sampler::kBlue && sampler != Sampler::kFine);
  if (sampler != Sampler::kRandom) return;
  sorted_.resize(count);
  for (std::uint64_t i = 0; i < count; ++i) sorted_[i] = uniform_number(seed, i);
  std::sort(sorted_.begin(), sorted_.end());
}

double Sequence::at(std::uint64_t index) const {
  const auto part = [&](double offset) {
    return std::min((static_cast<double>(index) + offset) / static_cast<double>(count_), 1 - 0x1p-53);
  };
  switch (sampler_) {
    case Sampler::kRandom:
      return sorted_[index];
    case Sampler::kHalton:
      return ranked({0, count_}, index);
    case Sampler::kSobol:
      return ranked_gray({kDropped + 1, kDropped + 1 + count_}, index);
    case Sampler::kNiederreiter:
      return ranked_gray({kDropped, kDropped + count_}, index);
    case Sampler::kHammersley:
      return part(0);
    case Sampler::kEven:
      return part(.5);
    default:
      return part(uniform_number(seed_, index));
  }
}

}  // namespace hilbrush
