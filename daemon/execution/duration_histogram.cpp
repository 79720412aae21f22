#include "daemon/execution/duration_histogram.h"

#include <algorithm>
#include <cmath>

namespace hilbrush {
namespace {

constexpr double kShortestS = 1e-6;

}  // namespace

void DurationHistogram::add(double duration_s) {
  const double bin = std::log2(std::max(duration_s, kShortestS) / kShortestS) * kBinsPerOctave;
  ++bins_[std::min(bins_.size() - 1, static_cast<std::size_t>(bin))];
  ++count_;
  longest_s_ = std::max(longest_s_, duration_s);
}

void DurationHistogram::add(const DurationHistogram& other) {
  for (std::size_t i = 0; i < bins_.size(); ++i) bins_[i] += other.bins_[i];
  count_ += other.count_;
  longest_s_ = std::max(longest_s_, other.longest_s_);
}

double DurationHistogram::quantile_s(double q) const {
  if (count_ == 0) return 0;
  const auto wanted = static_cast<std::uint64_t>(std::ceil(q * static_cast<double>(count_)));
  std::uint64_t so_far = 0;
  for (std::size_t i = 0; i < bins_.size(); ++i) {
    so_far += bins_[i];
    // The bin's upper end, so that the figure is never kinder than the truth.
    if (so_far >= std::max<std::uint64_t>(wanted, 1))
      return std::min(longest_s_, kShortestS * std::exp2(static_cast<double>(i + 1) / kBinsPerOctave));
  }
  return longest_s_;
}

}  // namespace hilbrush
