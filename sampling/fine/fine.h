#pragma once
#include <functional>

#include "sampling/curve/surface_curve.h"
#include "sampling/dots/dots.h"
#include "sampling/tone/tone_field.h"

/// `fine`: dots that have been placed already are moved for the picture that the paint will show.
namespace hilbrush {

/// What one dot does to the paint, as sampling needs to know it: a Gaussian spot at normal incidence, and the paint's
/// answer to the doses that add up.
struct SpotModel {
  double radius_m = 0;  ///< 1/e2
  /// Coverage 0..1 for a dose; 1 is the dose that a dot of level 1 spreads over one pitch squared. Smooth or with
  /// kinks; called a few thousand times.
  std::function<double(double)> coverage;
};

struct FineOptions {
  int passes = 24;  ///< each costs about as much as painting the dots once; 24 is most of what there is to gain
};

/// Moves the dots down the gradient of the squared error of the painted picture, blurred by one pitch (what F1 of the
/// fidelity measures), all of them in each pass. Count, order, level and component stay; dots stay on the surface and
/// on toned surface. Returns the best of all passes, so never a worse picture by this measure than it was given.
/// Same bytes for any number of threads. Keeps some 1.5 kB a pitch squared of surface.
/// Cost: CPU seconds some .5 a pass for 100,000 dots.
/// @throws InputError if the spot has no size or there is less than one pass.
DotSequence refine_dots(const SurfaceCurve& curve, const ToneField& tone, DotSequence dots, const SpotModel& spot,
                        const FineOptions& options = {}, const Progress& progress = {});

}  // namespace hilbrush
