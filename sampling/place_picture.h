#pragma once
#include <functional>
#include <optional>
#include <vector>

#include "sampling/curve/surface_curve.h"
#include "sampling/dots/path_meter.h"
#include "sampling/fine/fine.h"
#include "sampling/gaps/fill_holes.h"
#include "sampling/predictive/predictive_loop.h"

/// From a picture on a surface to dots, with everything that an operator may choose: curve, placement, levels
/// of energy, the predictive loop, the search on the finished dots. place_dots() and the others do one thing
/// each; this combines them in the only useful order:
///   place by density -> fill holes -> levels -> (predict the picture and place again: predictive_loop.h)
///   -> fine (fine.h)
namespace hilbrush {

struct PictureOptions {
  SampleOptions sample;  ///< kFine places as kCentroid
  CurveKind curve = CurveKind::kHilbert;
  std::vector<double> levels = {1};  ///< see energy_levels()
  int predictive_rounds = 0;
  std::optional<double> largest_gap_pitches = {};      ///< see fill_holes.h; not for laminar slices
  int fine_passes = 24;                                ///< of kFine
  std::function<SpotModel(double pitch_m)> spot = {};  ///< of kFine
};

struct PictureReport {
  SampleReport path;  ///< along the dots that are returned
  PredictiveReport predictive;
  FillReport filled;
  std::vector<std::uint64_t> dots_of_level;  ///< one element for each level
};

/// `tone` is the asked tone, made with `tone_options` on the mesh of `curve`. `predict` is called only if
/// there are predictive rounds. Laminar slices use only the mesh of `curve`. Deterministic. @throws
/// InputError as place_dots().
DotSequence place_picture(const SurfaceCurve& curve, const ToneField& tone, const ToneOptions& tone_options,
                          const PictureOptions& options, const PicturePredictor& predict,
                          PictureReport* report = nullptr, const Progress& progress = {});

}  // namespace hilbrush
