#pragma once
#include "planner/cell_model/cell_description.h"
#include "planner/cell_model/mounting_options.h"
#include "sampling/model/textured_mesh.h"

/// How one job's object is held, applied to cell and mesh.
namespace hilbrush {

/// The cell with this job's post and plate. Its name and hash stay: what the job changes is in the job's
/// settings.
CellDescription with_fixture(CellDescription cell, const MountingOptions& mounting);

/// The mesh, standing centered on z = 0, turned about z and then shifted.
TexturedMesh mounted(TexturedMesh mesh, const MountingOptions& mounting);

}  // namespace hilbrush
