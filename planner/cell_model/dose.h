#pragma once
#include <string>

#include "planner/cell_model/exposure_program.h"

/// Energy into power and pulse.
namespace hilbrush {

struct Dose {
  float energy_j = 0, power_w = 0, pulse_s = 0;
};

/// The dose of a dot of `level`: the cell's preferred pulse at the power that makes the energy; a longer pulse where
/// the laser is too weak, a shorter one where it cannot be turned down enough. An oblique spot is longer and fainter
/// but carries the same energy, so the incidence plays no part. False if the laser's limits allow no such pulse;
/// `detail` (a sentence) then says why.
bool find_dose(const CellDescription& cell, double pitch_m, double level, Dose& dose, std::string& detail);

}  // namespace hilbrush
