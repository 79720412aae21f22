#pragma once
#include <string>

#include "sim/script/endpoints.h"

namespace hilbrush {

/// The text of a cell file whose devices are the drivers that talk to a simulated cell on wires, at its endpoints and
/// on a clock of its scale; everything else stays as it is in `cell_text`. @throws InputError if that is no JSON
/// object.
std::string wired_cell_text(const std::string& cell_text, const WireEndpoints& endpoints, double time_scale);

}  // namespace hilbrush
