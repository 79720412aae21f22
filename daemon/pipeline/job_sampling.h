#pragma once
#include <string>

#include "config/job_settings.h"
#include "planner/cell_model/cell_description.h"
#include "sampling/place_picture.h"

/// From a job's settings to its dots: the sampling part of the pipeline.
namespace hilbrush {

/// What the paint and the tone curve ask for in this job on this cell; `warning` as tone_options() of config.
/// `mesh` gives the pitch of a job that names its number of dots.
ToneOptions job_tone_options(const CellDescription& cell, const JobSettings& settings, const TexturedMesh& mesh,
                             std::string& warning);

/// The sampler whose tone curve this one paints by: fine moves the dots of centroid, and on flat tone moves nothing.
Sampler calibrated_sampler(Sampler sampler);

/// Placement, levels, rounds and limits of the job. Keeps a reference to `cell`.
PictureOptions picture_options(const CellDescription& cell, const JobSettings& settings);

/// How many dots fit into the memory that is free, with all that the pipeline keeps for each.
std::uint64_t dot_limit_by_memory();

}  // namespace hilbrush
