#pragma once
#include <vector>

#include "sampling/curve/chart.h"
#include "sampling/curve/surface_curve.h"
#include "sampling/disk/components.h"
#include "sampling/model/edges.h"

/// From components to charts: each is flattened, the pieces are chained, and their base trees are built.
namespace hilbrush {

struct Charts {
  std::vector<Chart>
      charts;  ///< in the order in which they are walked; several of one component if it was divided
  std::vector<ComponentReport> reports;  ///< as `components`
};

/// In parallel over components; the same result for any number of threads. `progress` is called from this
/// thread.
Charts build_charts(const TexturedMesh& mesh, const Neighbors& neighbors,
                    const std::vector<Component>& components, CurveKind kind, const Progress& progress);

}  // namespace hilbrush
