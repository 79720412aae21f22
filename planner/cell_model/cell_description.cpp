#include "planner/cell_model/cell_description.h"

#include <algorithm>
#include <cmath>

namespace hilbrush {

Joints home_joints(const CellDescription& cell) {
  Joints home;
  for (std::size_t i = 0; i < kAxisCount; ++i) home[i] = cell.axes[i].home;
  return home;
}

double spot_diameter_m(const CellDescription& cell, double pitch_m) {
  return cell.laser.spot_diameter_m.value_or(cell.laser.spot_pitches * pitch_m);
}

double full_energy_j(const CellDescription& cell, double pitch_m) {
  return cell.paint.dose_full_j_m2 * pitch_m * pitch_m;
}

double painted_coverage(PaintResponse response, double x) {
  x = std::max(x, 0.);
  switch (response) {
    case PaintResponse::kLinear:
      return std::min(x, 1.);
    case PaintResponse::kSaturating:
      return 1 - std::exp(-3 * x);
    case PaintResponse::kSigmoid: {
      // A Hill curve: half covered at half the full dose, slope 2 there, 94 % at the full dose.
      const double x2 = x * x;
      const double half2 = .25;
      return x2 * x2 / (x2 * x2 + half2 * half2);
    }
  }
  return 0;
}

}  // namespace hilbrush
