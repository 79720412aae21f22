#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "planner/plan.h"
#include "sampling/dots/dots.h"
#include "sampling/images/image_file.h"
#include "sampling/model/textured_mesh.h"

/// Pictures of a plan for the people who sign it.
namespace hilbrush {

/// Six views (as in exposure.png), three rows: reach (exposed dots light, skipped ones in the color of their reason),
/// incidence (degrees against the face normal), path (lines from dot to dot, colored from first to last; white where
/// the tool was drawn back in between). Each row has a legend.
Picture planning_sheet(const TexturedMesh& mesh, const DotSequence& dots, const Plan& plan);

/// The color of a reason on that sheet, sRGB.
std::array<std::uint8_t, 3> skip_reason_color(SkipReason reason);

/// Writes into `folder` planning.png, that sheet, and time.svg: what the program's time is spent on, over the
/// exposures. Returns the files written. @throws InputError naming a file that can't be written.
std::vector<std::filesystem::path> write_planning_pictures(const TexturedMesh& mesh, const DotSequence& dots,
                                                           const Plan& plan, const CellDescription& cell,
                                                           const std::filesystem::path& folder);

}  // namespace hilbrush
