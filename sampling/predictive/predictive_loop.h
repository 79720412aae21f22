#pragma once
#include <functional>
#include <span>
#include <vector>

#include "sampling/base/progress.h"
#include "sampling/dots/dots.h"
#include "sampling/options/tone_options.h"
#include "sampling/tone/tone_field.h"

/// Places dots, predicts the picture they will make, and corrects what is asked for where it is too light or
/// too dark.
///
/// A tone curve is measured on flat gray; a picture also has edges, thin lines, grain and curved surface. The
/// loop measures what they do to the tone and subtracts a share of the error from the wanted tone. What is
/// asked for then is not a function of the texture any more (texture coordinates overlap: one texel may be
/// many places), so it is kept in an atlas of the triangles (tone/asked_atlas.h), on which the curve
/// integrates as exactly as on a texture. Blank surface stays blank.
namespace hilbrush {

/// Predicts what the paint will show; implemented with the simulated film (sim/film/prediction.h).
struct PicturePredictor {
  /// Gaussian means, sigma one pitch on the surface, of the wanted coverage at these points.
  std::function<std::vector<float>(double pitch_m, std::span<const SurfacePoint> points)> wanted;
  /// The same of the coverage that `dots` would paint.
  std::function<std::vector<float>(const DotSequence& dots, std::span<const SurfacePoint> points)> painted;
};

struct PredictiveOptions {
  int rounds = 2;
  double share = .6;                 ///< of the error, subtracted from the wanted tone in each round
  std::vector<double> levels = {1};  ///< energies of the dots, see levels.h
  double texel_limit = 64'000'000.;  ///< texels of the atlas; a larger one is made coarser than half a pitch
};

/// Places dots by their density; their levels are assigned afterwards.
using PlaceByDensity = std::function<DotSequence(const ToneField& density)>;

struct PredictiveReport {
  std::vector<double> error_rms;  ///< of the mean coverage over a pitch, before each round
  std::size_t texel_count = 0;
};

/// `asked` and `density` are the fields of the energy asked for and of the dots (the same field with one
/// level); `curve` is the tone curve in `asked`. Deterministic. Memory: ten bytes a texel (24 with levels),
/// four texels a pitch squared and as many again for the atlas's corners, in addition to the film's. Cost:
/// each round places, paints and measures all dots once.
DotSequence place_predictively(const ToneField& asked, const ToneField& density, const ToneCurve& curve,
                               const PredictiveOptions& options, const PlaceByDensity& place,
                               const PicturePredictor& predict, PredictiveReport* report = nullptr,
                               const Progress& progress = {});

}  // namespace hilbrush
