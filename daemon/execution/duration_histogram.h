#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

/// Quantiles of many durations in constant memory: counts in bins a twentieth of an octave wide (3.5 %), from
/// a microsecond to half an hour; what is shorter or longer is counted in the first or last bin. Plain value,
/// one thread.
namespace hilbrush {

class DurationHistogram {
 public:
  void add(double duration_s);
  void add(const DurationHistogram& other);
  std::uint64_t count() const { return count_; }
  /// The duration that a share `q` (0..1) of all does not exceed, within a bin's width; 0 if there are none.
  double quantile_s(double q) const;
  double longest_s() const { return longest_s_; }

 private:
  static constexpr std::size_t kBinsPerOctave = 20;
  static constexpr std::size_t kOctaves = 31;
  std::array<std::uint32_t, kBinsPerOctave * kOctaves> bins_{};
  std::uint64_t count_ = 0;
  double longest_s_ = 0;
};

}  // namespace hilbrush
