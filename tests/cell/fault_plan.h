#pragma once
#include <random>
#include <string>

#include "planner/cell_description.h"
#include "sim/wire/fault_script.h"

namespace hilbrush::test {

/// A fault of a random kind in a random phase of a random dot among `dots`, seeded.
WireFault random_fault(std::mt19937& random, std::size_t dots);

/// In words, for failures: "late_answer of table, 3.2 ms into settling 7".
std::string described(const WireFault& fault);

}  // namespace hilbrush::test
