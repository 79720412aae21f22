#pragma once
#include <cstdint>

/// Hashed numbers: the same for the same seed and index, whichever thread asks and in whatever order.
/// SplitMix64 after Steele, Lea and Flood, "Fast Splittable Pseudorandom Number Generators", OOPSLA 2014.
namespace hilbrush {

/// 2^64 over the golden ratio, odd: what SplitMix64's state is advanced by.
inline constexpr std::uint64_t kGoldenGamma = 0x9e3779b97f4a7c15u;

/// SplitMix64's finalizer: every bit of `x` reaches every bit of the result, and no two results are alike. 0
/// stays 0.
constexpr std::uint64_t mix_bits(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

/// What a SplitMix64 generator whose state is `state` gives next.
constexpr std::uint64_t splitmix64(std::uint64_t state) {
  return mix_bits(state + kGoldenGamma);
}

/// The 53 high bits as a number in [0, 1).
constexpr double unit_interval(std::uint64_t bits) {
  return static_cast<double>(bits >> 11) * 0x1p-53;
}

}  // namespace hilbrush
