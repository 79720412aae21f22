#pragma once
#include "sampling/curve/surface_curve.h"
#include "sampling/dots/dots.h"
#include "sampling/dots/path_meter.h"
#include "sampling/options/sample_options.h"
#include "sampling/tone/tone_field.h"

/// Mesh to dots, the entry of sampling/:
///   repair_mesh -> components -> flatten (cut_to_disk, map_to_square)
///   -> SurfaceCurve (base tree of the adaptive curve) -> CurveMass (its exact masses under a tone)
///   -> strata -> dots, one after another along the curve.
/// A component that cannot be mapped validly is divided; what still cannot is ordered along a 3D Hilbert
/// curve, and the report says why.
namespace hilbrush {

/// Places dots with any sampler, for a tone that is sampled once: kBlue by place_blue(), the others by
/// stream_dots(). kFine: as kCentroid, for refine_dots() to begin with. Errors as count_dots().
DotSequence place_dots(const SurfaceCurve& curve, const ToneField& tone, const SampleOptions& options,
                       SampleReport* report = nullptr, const Progress& progress = {});

}  // namespace hilbrush
