#pragma once
#include <filesystem>
#include <vector>

#include "planner/plan.h"
#include "sampling/dots.h"
#include "sampling/textured_mesh.h"

/// Pictures of a plan for the people who sign it.
namespace hilbrush {

/// Writes into `folder`
///   planning.png  six views (as in exposure.png), three rows: reach (exposed dots light, skipped ones in the colour of
///                 their reason), incidence (degrees against the face normal), path (lines from dot to dot, coloured
///                 from first to last; white where the tool was drawn back in between);
///   time.svg      what the program's time is spent on, over the exposures.
/// Returns the files written. @throws InputError naming a file that can't be written.
std::vector<std::filesystem::path> write_planning_pictures(const TexturedMesh& mesh, const DotSequence& dots,
                                                           const Plan& plan, const CellDescription& cell,
                                                           const std::filesystem::path& folder);

}  // namespace hilbrush
