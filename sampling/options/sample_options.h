#pragma once
#include <cstdint>
#include <optional>

#include "sampling/base/enum_names.h"

/// Settings of sampling, and the names of their choices. No mesh and no picture, so that config/ can read
/// them.
namespace hilbrush {

/// How a dot is placed in its stratum (a stretch of the curve that holds the mass of one dot).
enum class Sampler {
  kCentroid,  ///< at the stratum's center of mass, put back on the surface (default)
  kJittered,  ///< at a random place along the stratum (the thesis, section 4.4)
  kEven,      ///< in the middle of the stratum along the curve
  kRandom,    ///< anywhere along the whole curve, sorted: the control
  kHalton,    ///< low-discrepancy sequences in one dimension, along the whole curve, sorted (section 4.4)
  kHammersley,
  kSobol,
  kNiederreiter,
  kBlue,  ///< in the stratum where neighbors push least: an isotropic blue-noise spectrum
  kFine   ///< centroid, then moved for the picture that the paint will show (refine_dots)
};

inline constexpr EnumName<Sampler> kSamplerNames[] = {
    {Sampler::kCentroid, "centroid"}, {Sampler::kJittered, "jittered"},
    {Sampler::kEven, "even"},         {Sampler::kRandom, "random"},
    {Sampler::kHalton, "halton"},     {Sampler::kHammersley, "hammersley"},
    {Sampler::kSobol, "sobol"},       {Sampler::kNiederreiter, "niederreiter"},
    {Sampler::kBlue, "blue"},         {Sampler::kFine, "fine"},
};

inline const char* sampler_name(Sampler sampler) {
  return name_of(kSamplerNames, sampler);
}

/// In which order the surface is walked.
enum class CurveKind {
  kHilbert,  ///< table 4.1 of the thesis (default)
  kPeano2,   ///< table 4.2: nine children
  kLaminar   ///< plane slices from the table upwards: what the curves replace, as a baseline
};

inline constexpr EnumName<CurveKind> kCurveNames[] = {
    {CurveKind::kHilbert, "hilbert"},
    {CurveKind::kPeano2, "peano2"},
    {CurveKind::kLaminar, "laminar"},
};

inline const char* curve_name(CurveKind curve) {
  return name_of(kCurveNames, curve);
}

/// What decides how many dots a piece of surface asks for.
enum class DensitySource {
  kTexture,           ///< the wanted tone (default)
  kMeanCurvature,     ///< section 6.1.3
  kGaussianCurvature  ///< section 6.1.3
};

inline constexpr EnumName<DensitySource> kDensityNames[] = {
    {DensitySource::kTexture, "texture"},
    {DensitySource::kMeanCurvature, "mean_curvature"},
    {DensitySource::kGaussianCurvature, "gaussian_curvature"},
};

inline const char* density_name(DensitySource density) {
  return name_of(kDensityNames, density);
}

struct SampleOptions {
  std::optional<double> pitch_m = {};           ///< the count follows: mass / pitch^2, rounded
  std::optional<std::uint64_t> dot_count = {};  ///< or exactly this many; the pitch follows
  Sampler sampler = Sampler::kCentroid;
  std::uint64_t seed = 1;
  double omega = 4;  ///< a quad is split while it may misplace more than 1/omega of a dot
  std::optional<int> uniform_depth = {};  ///< or: until it has this depth, whatever it holds; for comparison
  std::uint64_t dot_limit = 50'000'000;   ///< more is an InputError that names dpi and size
};

/// @throws InputError if neither or both of pitch and count are given, or the one given is not a positive
/// number.
void check_pitch_or_count(const SampleOptions& options);
/// @throws InputError if `count` dots are more than dot_limit.
void check_dot_limit(const SampleOptions& options, double count);

}  // namespace hilbrush
