#pragma once
#include <vector>

#include "sampling/quality/quality.h"

namespace hilbrush {

/// Distance between neighbors of the densest packing in the plane, each with an area of `area_each`.
double densest_packing_distance(double area_each);

/// Figures of distances in any order; infinite ones (no neighbor at all) are left out.
Spacing spacing_figures(std::vector<double> distances);

}  // namespace hilbrush
