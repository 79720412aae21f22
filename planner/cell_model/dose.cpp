#include "planner/cell_model/dose.h"

#include <algorithm>

#include "sampling/base/text.h"

namespace hilbrush {

DoseResult find_dose(const CellDescription& cell, double pitch_m, double level) {
  const auto& laser = cell.laser;
  const double energy_j = level * full_energy_j(cell, pitch_m);
  const double min_j = laser.power_min_w * laser.pulse_min_s;
  const double max_j = laser.power_max_w * laser.pulse_max_s;
  if (!(energy_j >= min_j && energy_j <= max_j)) {
    const auto millijoules = [](double value_j) { return number(value_j * 1e3, 3); };
    return {std::nullopt, "needs " + millijoules(energy_j) + " mJ, the laser gives " + millijoules(min_j) +
                              " to " + millijoules(max_j) + " mJ"};
  }
  const double power_w = std::clamp(energy_j / laser.pulse_s, laser.power_min_w, laser.power_max_w);
  const double pulse_s = std::clamp(energy_j / power_w, laser.pulse_min_s, laser.pulse_max_s);
  return {Dose{static_cast<float>(energy_j), static_cast<float>(power_w), static_cast<float>(pulse_s)}, {}};
}

}  // namespace hilbrush
