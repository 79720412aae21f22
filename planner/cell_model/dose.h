#pragma once
#include <optional>
#include <string>

#include "planner/cell_model/cell_description.h"

/// Energy into power and pulse.
namespace hilbrush {

struct Dose {
  float energy_j = 0;
  float power_w = 0;
  float pulse_s = 0;
};

/// A dose, or why there is none.
struct DoseResult {
  std::optional<Dose> dose;
  std::string refusal;  ///< a sentence with the amounts; empty if there is a dose
};

/// The dose of a dot of `level`: the cell's preferred pulse at the power that makes the energy; a longer
/// pulse where the laser is too weak, a shorter one where it cannot be turned down enough. An oblique spot is
/// longer and fainter but carries the same energy, so the incidence plays no part. Refused if the laser's
/// limits allow no such pulse.
DoseResult find_dose(const CellDescription& cell, double pitch_m, double level);

}  // namespace hilbrush
