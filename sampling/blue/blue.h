#pragma once
#include "sampling/curve/surface_curve.h"
#include "sampling/dots/dots.h"
#include "sampling/dots/path_meter.h"
#include "sampling/tone/tone_field.h"

/// `blue`: dots as far from each other as their strata allow, in no direction more than in another.
namespace hilbrush {

/// One dot in each stratum of the curve, where the repulsion by the other dots (a Gaussian kernel) minus the
/// attraction of the asked surface is least: first the best of eight candidates that lie evenly along the
/// stratum, in a few sweeps; then a few Newton steps from it. The kernel follows the local spacing, distances
/// are in space, and only dots on surface that faces the same way count. Exact count, in order of the curve;
/// same bytes for any number of threads. After Fattal, "Blue-Noise Point Sampling using Kernel Density
/// Model", 2011; differs: dots stay in their strata, so that the low discrepancy and the short path of the
/// curve stay, and no temperature is needed. Options, report and errors as place_dots, which calls this for
/// Sampler::kBlue. Cost: some 7 CPU seconds and 800 MB a million dots.
DotSequence place_blue(const SurfaceCurve& curve, const ToneField& tone, const SampleOptions& options,
                       SampleReport* report = nullptr, const Progress& progress = {});

}  // namespace hilbrush
