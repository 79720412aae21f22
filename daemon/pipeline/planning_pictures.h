#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "planner/plan.h"
#include "sampling/dots/dots.h"
#include "sampling/images/image_file.h"
#include "sampling/model/textured_mesh.h"
#include "sampling/quality/plot.h"

/// Pictures of a plan, to look at before it is painted.
namespace hilbrush {

/// Six views (as in exposure.png) in three rows, each with a legend. Reach: exposed dots light, skipped ones
/// in the color of their reason. Incidence: degrees against the face normal. Path: lines from dot to dot,
/// colored from first to last, and white where the tool retracts in between.
Picture planning_sheet(const TexturedMesh& mesh, const DotSequence& dots, const Plan& plan);

/// The color of a reason in that picture, sRGB.
std::array<std::uint8_t, 3> skip_reason_color(SkipReason reason);

/// The time of the program so far over its exposures, in hours, minutes or seconds, and what it is spent on;
/// the legend says each part as h:mm and as a share of all.
Plot time_plot(const CellDescription& cell, const ExposureProgram& program);

/// Writes into `folder` planning.png, the picture above, and time.svg: the time of the program, divided by
/// what it is spent on, over the exposures. Returns the files written. @throws InputError naming a file that
/// cannot be written.
std::vector<std::filesystem::path> write_planning_pictures(const TexturedMesh& mesh, const DotSequence& dots,
                                                           const Plan& plan, const CellDescription& cell,
                                                           const std::filesystem::path& folder);

}  // namespace hilbrush
