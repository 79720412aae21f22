#include "planner/cell_model/dose.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace hilbrush {

bool find_dose(const CellDescription& cell, double pitch_m, double level, Dose& dose, std::string& detail) {
  const auto& laser = cell.laser;
  const double energy_j = level * full_energy_j(cell, pitch_m);
  const double least_j = laser.power_min_w * laser.pulse_min_s, most_j = laser.power_max_w * laser.pulse_max_s;
  if (!(energy_j >= least_j && energy_j <= most_j)) {
    char text[96];
    std::snprintf(text, sizeof text, "needs %.3g mJ, the laser gives %.3g to %.3g mJ", energy_j * 1e3, least_j * 1e3,
                  most_j * 1e3);
    detail = text;
    return false;
  }
  const double power_w = std::clamp(energy_j / laser.pulse_s, laser.power_min_w, laser.power_max_w);
  const double pulse_s = std::clamp(energy_j / power_w, laser.pulse_min_s, laser.pulse_max_s);
  dose = {static_cast<float>(energy_j), static_cast<float>(power_w), static_cast<float>(pulse_s)};
  return true;
}

}  // namespace hilbrush
