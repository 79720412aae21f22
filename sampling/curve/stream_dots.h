#pragma once
#include <cstdint>
#include <functional>
#include <span>

#include "sampling/base/progress.h"
#include "sampling/curve/curve_mass.h"
#include "sampling/dots/dots.h"
#include "sampling/dots/path_meter.h"
#include "sampling/options/sample_options.h"

/// Dots one after another along a curve whose mass is known. Any sampler, blue included:
/// sampling/place_dots.h.
namespace hilbrush {

/// How many dots the options ask for; 0 if nothing asks for dots and a pitch is given.
/// @throws InputError if neither or both of pitch and count are given, dot_limit is exceeded, or a count is
/// given and everything is white, blank or transparent.
std::uint64_t count_dots(const CurveMass& mass, const SampleOptions& options);

/// The pitch of `count` dots.
double pitch_of(const CurveMass& mass, const SampleOptions& options, std::uint64_t count);

/// Takes the dots, block by block, in order of the curve.
using DotVisitor = std::function<void(std::span<const Dot>)>;

/// Spreads dots along the curve so that every stretch of equal mass (asked coverage times area) gets one, and
/// hands them on in order. Nothing is kept: memory is bounded whatever their number. Same input and seed:
/// same bytes, whatever the number of threads. `visit` and `progress` are called from this thread and may
/// throw to end it. Samplers: all but kBlue, which needs all dots at once. Errors as count_dots().
void stream_dots(const CurveMass& mass, const SampleOptions& options, const DotVisitor& visit,
                 SampleReport* report = nullptr, const Progress& progress = {});

/// The same, collected. kFine: as kCentroid, for refine_dots() to begin with.
DotSequence place_dots(const CurveMass& mass, const SampleOptions& options, SampleReport* report = nullptr,
                       const Progress& progress = {});

}  // namespace hilbrush
