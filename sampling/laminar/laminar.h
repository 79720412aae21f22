#pragma once
#include "sampling/base/progress.h"
#include "sampling/dots/dots.h"
#include "sampling/dots/path_meter.h"
#include "sampling/options/sample_options.h"
#include "sampling/tone/tone_field.h"

/// Laminar slicing, the method that space-filling curves replace: a baseline (the thesis, section 7.3,
/// figures 7.11 and 7.14 to 7.16; Sung et al., McPherson et al.).
namespace hilbrush {

/// Cuts the mesh by horizontal planes one pitch apart, from the table (low z) upwards, and walks along each
/// contour: one dot for each pitch of asked tone times length; what remains at the end of a contour is
/// carried into the next. Closed and open contours of a slice follow each other by the shortest jump. On
/// upright walls the dots lie one pitch apart both ways; where the surface leans, slices lie farther apart on
/// it and there are fewer dots than its mass asks for, and a horizontal face gets none: a property of the
/// method. With `pitch_m` the count follows; with `dot_count` the pitch is searched so that slices and dots
/// along them are equally far apart (within a percent), and the count is exact. omega, sampler and seed have
/// no effect. Deterministic. `report`, if given, holds the path and, as patch_count, the number of pieces of
/// all contours.
/// @throws InputError as place_dots(), and if the surface asks for dots but its slices give none: level
/// sheets, needles.
DotSequence place_laminar(const TexturedMesh& mesh, const ToneField& tone, const SampleOptions& options,
                          SampleReport* report = nullptr, const Progress& progress = {});

}  // namespace hilbrush
