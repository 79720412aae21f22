#include "daemon/painted_dots.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <vector>

#include "sampling/check.h"

namespace hilbrush {
namespace {

constexpr double kJointTolerance = 1e-6;  // rad, m: far below a dot, far above rounding
constexpr double kOffTargetM = 10e-6;
constexpr double kFullPulseShare = .999;  // a pulse that the device ended itself is full

bool same_joints(const Joints& a, const Joints& b) {
  for (int i = 0; i < kAxisCount; ++i)
    if (std::abs(a[i] - b[i]) > kJointTolerance) return false;
  return true;
}

/// Exposures by their joints: sorted by J1, which nearly always tells them apart.
class ExposureIndex {
 public:
  explicit ExposureIndex(const ExposureProgram& program) : program_(program), order_(program.exposures.size()) {
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    std::sort(order_.begin(), order_.end(), [&](std::size_t a, std::size_t b) { return j1(a) < j1(b); });
  }
  std::optional<std::size_t> find(const Joints& joints) const {
    auto it = std::lower_bound(order_.begin(), order_.end(), joints[kJ1] - kJointTolerance,
                               [&](std::size_t i, double value) { return j1(i) < value; });
    for (; it != order_.end() && j1(*it) <= joints[kJ1] + kJointTolerance; ++it)
      if (same_joints(program_.exposures[*it].joints, joints)) return *it;
    return std::nullopt;
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
  struct Made {
    std::uint32_t full = 0, partial = 0;
  };
  std::vector<Made> made(program.exposures.size());
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
    ++(is_full ? made[*i].full : made[*i].partial);
    const double error_m = (hits[k].position_O - program.exposures[*i].position_O).norm();
    if (hits[k].is_shadowed) ++painted.hits.shadowed;
    if (!hits[k].is_hit || error_m > kOffTargetM) ++painted.hits.off_target;
    if (hits[k].is_hit) max_error_m = std::max(max_error_m, error_m);
  }
  for (const Made& m : made) {
    if (m.full > 0)
      ++painted.exposed;
    else if (m.partial > 0)
      ++painted.in_doubt;
    if (m.full > 1) ++painted.repeated;
  }
  painted.hits.max_error_um = max_error_m * 1e6;
  return painted;
}

}  // namespace hilbrush
