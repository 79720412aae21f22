#include "tests/cell/witness.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

namespace hilbrush::test {
namespace {

constexpr double kGrid = 1e-3;

long long cell_of(double j1) {
  return std::llround(std::floor(j1 / kGrid));
}

/// Finds exposures by their joints.
class Places {
 public:
  explicit Places(const ExposureProgram& program) : program_(program) {
    for (std::size_t i = 0; i < program.exposures.size(); ++i)
      by_j1_.emplace(cell_of(program.exposures[i].joints[kJ1]), i);
  }
  std::optional<std::size_t> nearest(const Joints& joints, double tolerance) const {
    std::optional<std::size_t> found;
    double smallest = tolerance;
    for (long long cell = cell_of(joints[kJ1]) - 1; cell <= cell_of(joints[kJ1]) + 1; ++cell) {
      const auto [begin, end] = by_j1_.equal_range(cell);
      for (auto it = begin; it != end; ++it) {
        double away = 0;
        for (std::size_t axis = 0; axis < kAxisCount; ++axis)
          away = std::max(away, std::abs(program_.exposures[it->second].joints[axis] - joints[axis]));
        if (away > smallest) continue;
        smallest = away;
        found = it->second;
      }
    }
    return found;
  }

 private:
  const ExposureProgram& program_;
  std::multimap<long long, std::size_t> by_j1_;
};

/// Light that goes on with another power is recorded as another emission; to the paint it is the same pulse.
std::vector<Emission> joined(const std::vector<Emission>& emissions) {
  std::vector<Emission> pulses;
  for (const Emission& emission : emissions) {
    if (!pulses.empty() &&
        std::abs(pulses.back().start_s + pulses.back().length_s - emission.start_s) < 1e-9) {
      pulses.back().length_s += emission.length_s;
      pulses.back().is_moving = pulses.back().is_moving || emission.is_moving;
      pulses.back().power_w = std::min(pulses.back().power_w, emission.power_w);
      continue;
    }
    pulses.push_back(emission);
  }
  return pulses;
}

}  // namespace

Testimony hear_witness(const ExposureProgram& program, std::vector<Emission> emissions,
                       const WitnessOptions& options) {
  const Places places(program);
  Testimony testimony;
  testimony.light.resize(program.exposures.size());
  testimony.is_whole.resize(program.exposures.size());
  for (const Emission& emission : joined(emissions)) {
    if (emission.is_moving) ++testimony.in_motion;
    const auto place = places.nearest(emission.joints, options.joint_tolerance);
    const double commanded_s =
        place ? static_cast<double>(program.exposures[*place].pulse_s) : emission.commanded_s;
    const double overrun_s = emission.length_s - commanded_s;
    testimony.longest_overrun_s = std::max(testimony.longest_overrun_s, overrun_s);
    if (overrun_s > options.overrun_s + 1e-9) ++testimony.too_long;
    if (!place) {
      ++testimony.strays;
      continue;
    }
    const Exposure& exposure = program.exposures[*place];
    const double energy_j = emission.length_s * emission.power_w;
    const double wanted_j = static_cast<double>(exposure.power_w) * static_cast<double>(exposure.pulse_s);
    testimony.is_whole[*place] = ++testimony.light[*place] == 1 &&
                                 std::abs(energy_j - wanted_j) <= options.energy_tolerance * wanted_j;
  }
  return testimony;
}

std::string broken_invariants(const ExposureProgram& program, const Journal& journal,
                              const std::vector<Emission>& emissions, const WitnessOptions& options) {
  const Testimony testimony = hear_witness(program, emissions, options);
  std::string broken;
  const auto note = [&](const std::string& what) {
    if (broken.size() < 2000) broken += what + "\n";
  };
  if (testimony.in_motion > 0) note(std::to_string(testimony.in_motion) + " pulses in motion");
  if (testimony.strays > 0) note(std::to_string(testimony.strays) + " pulses where no dot is");
  if (testimony.too_long > 0)
    note(std::to_string(testimony.too_long) + " pulses too long, by up to " +
         std::to_string(testimony.longest_overrun_s * 1e3) + " ms");
  for (std::size_t i = 0; i < program.exposures.size(); ++i) {
    const int light = testimony.light[i];
    const std::string name = "exposure " + std::to_string(i);
    switch (journal.state(i)) {
      case ExposureState::kDone:
        if (light != 1) note(name + " is claimed done and was lit " + std::to_string(light) + " times");
        if (light == 1 && !testimony.is_whole[i]) note(name + " is claimed done and was lit in part");
        break;
      case ExposureState::kRemaining:
        if (light != 0) note(name + " is claimed to remain and was lit " + std::to_string(light) + " times");
        break;
      default:
        if (light > 1) note(name + " is in doubt and was lit " + std::to_string(light) + " times");
    }
  }
  return broken;
}

}  // namespace hilbrush::test
