#pragma once
#include <random>
#include <string>

#include "planner/cell_model/cell_description.h"
#include "sim/script/fault_script.h"

namespace hilbrush::test {

/// A fault of a random kind in a random phase of a random dot among `dots`, seeded.
WireFault random_fault(std::mt19937& random, std::size_t dots);

/// The same fault where the cell's time runs faster than this machine's: the wall time in which a drift is
/// noticed stays the same, so the axis leaves its place as fast in wall time as it would in real time.
WireFault in_wall_time(WireFault fault, double time_scale);

/// In words, for failures: "late_answer of table, 3.2 ms into settling 7".
std::string described(const WireFault& fault);

}  // namespace hilbrush::test
