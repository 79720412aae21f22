#include "daemon/pipeline/painted_dots.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <vector>

#include "sampling/base/check.h"

namespace hilbrush {
namespace {

/// Real axes stop beside their targets, anywhere in the window in which they report to be in position. Dots
/// are farther apart than that, so the nearest exposure is the commanded one. In radians and meters.
constexpr double kAngleTolerance = 5e-4;
constexpr double kTravelToleranceM = 5e-5;
constexpr double kOffTargetM = 10e-6;
constexpr double kFullPulseShare = .999;  ///< of the commanded length; shorter pulses were cut off

double tolerance_of(std::size_t axis) {
  return axis == kJ3 ? kTravelToleranceM : kAngleTolerance;
}

/// Distance of two poses: the largest difference of an axis, in tolerances of that axis.
double distance_of(const Joints& a, const Joints& b) {
  double worst = 0;
  for (std::size_t axis = 0; axis < kAxisCount; ++axis)
    worst = std::max(worst, std::abs(a[axis] - b[axis]) / tolerance_of(axis));
  return worst;
}

/// Finds exposures by their joints. Sorted by J1, which differs between nearly all of them.
class ExposureIndex {
 public:
  explicit ExposureIndex(const ExposureProgram& program)
      : program_(program), order_(program.exposures.size()) {
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    std::sort(order_.begin(), order_.end(), [&](std::size_t a, std::size_t b) { return j1(a) < j1(b); });
  }
  /// The exposure whose pose is nearest, if it is within the tolerances.
  std::optional<std::size_t> find(const Joints& joints) const {
    const auto first = std::lower_bound(order_.begin(), order_.end(), joints[kJ1] - kAngleTolerance,
                                        [&](std::size_t i, double value) { return j1(i) < value; });
    std::optional<std::size_t> nearest;
    double smallest = 1;
    for (auto it = first; it != order_.end() && j1(*it) <= joints[kJ1] + kAngleTolerance; ++it) {
      const double distance = distance_of(program_.exposures[*it].joints, joints);
      if (distance > smallest) continue;
      nearest = *it;
      smallest = distance;
    }
    return nearest;
  }

 private:
  double j1(std::size_t i) const { return program_.exposures[i].joints[kJ1]; }

  const ExposureProgram& program_;
  std::vector<std::size_t> order_;
};

}  // namespace

PaintedDots match_emissions(const ExposureProgram& program, std::span<const Emission> emissions,
                            std::span<const Hit> hits) {
  CHECK_EQ(emissions.size(), hits.size());
  struct PulseCounts {
    std::uint32_t full = 0;
    std::uint32_t partial = 0;
  };
  std::vector<PulseCounts> pulses(program.exposures.size());
  PaintedDots painted;
  const ExposureIndex index(program);
  double max_error_m = 0;
  for (std::size_t k = 0; k < emissions.size(); ++k) {
    const auto i = index.find(emissions[k].joints);
    if (!i) {
      ++painted.foreign;
      continue;
    }
    const bool is_full = emissions[k].length_s >= kFullPulseShare * emissions[k].commanded_s;
    ++(is_full ? pulses[*i].full : pulses[*i].partial);
    const double error_m = (hits[k].position_O - program.exposures[*i].position_O).norm();
    if (hits[k].is_shadowed) ++painted.hits.shadowed;
    if (!hits[k].is_hit || error_m > kOffTargetM) ++painted.hits.off_target;
    if (hits[k].is_hit) max_error_m = std::max(max_error_m, error_m);
  }
  for (const PulseCounts& counts : pulses) {
    if (counts.full > 0)
      ++painted.exposed;
    else if (counts.partial > 0)
      ++painted.in_doubt;
    if (counts.full > 1) ++painted.repeated;
  }
  painted.hits.max_error_um = max_error_m * 1e6;
  return painted;
}

}  // namespace hilbrush
