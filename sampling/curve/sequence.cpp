#include "sampling/curve/sequence.h"

#include <algorithm>

#include "sampling/check.h"

namespace hilbrush {
namespace {

/// Finalizer of SplitMix64 (Steele, Lea, Flood 2014).
std::uint64_t mix(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

}  // namespace

double uniform_number(std::uint64_t seed, std::uint64_t index) {
  const std::uint64_t golden = 0x9e3779b97f4a7c15u;
  return static_cast<double>(mix(mix(seed + golden) + golden * (index + 1)) >> 11) * 0x1p-53;
}

Sequence::Sequence(Sampler sampler, std::uint64_t count, std::uint64_t seed)
    : sampler_(sampler), count_(count), seed_(seed) {
  CHECK(sampler != Sampler::kCentroid);
  if (sampler != Sampler::kRandom) return;
  sorted_.resize(count);
  for (std::uint64_t i = 0; i < count; ++i) sorted_[i] = uniform_number(seed, i);
  std::sort(sorted_.begin(), sorted_.end());
}

double Sequence::at(std::uint64_t index) const {
  if (sampler_ == Sampler::kRandom) return sorted_[index];
  const double offset = sampler_ == Sampler::kEven ? .5 : uniform_number(seed_, index);
  return std::min((static_cast<double>(index) + offset) / static_cast<double>(count_), 1 - 0x1p-53);
}

}  // namespace hilbrush
