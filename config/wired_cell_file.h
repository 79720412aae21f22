#pragma once
#include <string>

#include "sim/script/endpoints.h"

namespace hilbrush {

/// The text of a cell file for a simulated cell on wires: its devices are the drivers for these endpoints,
/// its clock has this scale, and the rest is as in `cell_text`. @throws InputError if `cell_text` is not a
/// JSON object.
std::string wired_cell_text(const std::string& cell_text, const WireEndpoints& endpoints, double time_scale);

}  // namespace hilbrush
