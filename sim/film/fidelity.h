#pragma once
#include <functional>

#include "sampling/tone/tone_field.h"
#include "sim/film/film.h"

/// How well the painted picture matches the wanted one, in linear-light coverage on the surface (README,
/// "Fidelity").
namespace hilbrush {

struct FidelityFigures {
  double f1_db = 0,
         f2_db = 0;  ///< -10 log10 of the mean squared difference of Gaussian means, sigma = 1 and 2 pitches
  double s2 = 0;     ///< SSIM of six views
  double tone_rms = 0,
         tone_max = 0;  ///< error of mean tone per tenth of wanted tone, at 2 pitches, weighted by area
  double p999 = 0;      ///< 99.9th percentile of the absolute error at 2 pitches
};

struct Fidelity {
  FidelityFigures reachable;  ///< over the surface that passes the reach test
  FidelityFigures whole;
  double unreachable_share = 0;  ///< of the area
};

/// Whether the surface at a point can be exposed at all (the caller passes in the planner's Reach). Called
/// from several threads at a time. If empty, all of the surface can.
using ReachTest = std::function<bool(const SurfacePoint&)>;

/// At 20,000 points, one in each of as many strata of equal area, and in six views at 3 pixels a pitch (fewer
/// if a view would exceed some 24 million pixels). Figures of nothing (no surface, none reachable) are 0; of
/// no difference at all 99 dB. Same seed, same figures, for any number of threads. Cost: CPU seconds 1.5 for
/// 80 mm at 100 dpi, 5 at 300 dpi; half of them for the views.
Fidelity measure_fidelity(const Film& film, const ToneField& tone, const ReachTest& is_reachable,
                          std::uint64_t seed, const Progress& progress = {});

}  // namespace hilbrush
