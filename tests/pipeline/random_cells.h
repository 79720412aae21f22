#pragma once
#include <cstdint>
#include <string>

#include "planner/cell_model/cell_description.h"
#include "planner/cell_model/plan_options.h"
#include "sampling/model/textured_mesh.h"

/// A random cell, object and settings of planning, from a seed.
namespace hilbrush::testing_pipeline {

struct RandomWork {
  CellDescription cell;
  TexturedMesh mesh;  ///< standing on z = 0, centered, black; may need repair
  PlanOptions options;
  std::uint64_t dot_count = 0;
  std::string shape;  ///< what kind of mesh
};

/// Geometry, limits and dynamics of the cell anywhere between plausible and silly; home inside the limits.
/// Same seed, same work.
RandomWork random_work(std::uint64_t seed);

}  // namespace hilbrush::testing_pipeline
