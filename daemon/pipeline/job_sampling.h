#pragma once
#include <string>

#include "config/cell_file.h"
#include "config/job_settings.h"
#include "planner/cell_model/cell_description.h"
#include "sampling/model/placement.h"
#include "sampling/place_picture.h"

/// From the settings of a job to the options of sampling.
namespace hilbrush {

/// Paint and tone curve of this job on this cell. `mesh` gives the pitch of a job whose settings give the
/// number of dots.
CellTone job_tone(const CellDescription& cell, const JobSettings& settings, const TexturedMesh& mesh);

/// The sampler whose tone curve `sampler` uses. "fine" uses that of "centroid": it starts from its dots, and
/// on uniform tone it does not move them.
Sampler calibrated_sampler(Sampler sampler);

/// Where the model of this job stands, and its scale.
PlacementOptions placement_options(const JobSettings& settings);

/// Placement of the dots, levels, rounds and limits of the job. Keeps a reference to `cell`.
PictureOptions picture_options(const CellDescription& cell, const JobSettings& settings);

/// How many dots fit into the free memory, with everything that the pipeline keeps for each.
std::uint64_t dot_limit_by_memory();

}  // namespace hilbrush
