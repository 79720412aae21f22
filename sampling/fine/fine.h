#pragma once
#include <functional>

#include "sampling/curve/surface_curve.h"
#include "sampling/dots/dots.h"
#include "sampling/tone/tone_field.h"

/// The sampler `fine`: moves placed dots so that the painted picture comes closer to the wanted one.
namespace hilbrush {

/// The effect of one dot on the paint, as far as sampling needs it: a Gaussian spot at normal incidence, and
/// the coverage that the sum of doses gives.
struct SpotModel {
  double radius_m = 0;  ///< where the intensity has fallen to 1/e^2
  /// Coverage 0..1 for a dose; 1 is the dose that a dot of level 1 spreads over one pitch squared. It may
  /// have kinks. Called a few thousand times.
  std::function<double(double)> coverage;
};

struct FineOptions {
  int passes = 24;  ///< each costs about as much as painting the dots once; more than 24 gain little
};

/// Moves the dots down the gradient of the squared error of the painted picture, blurred by one pitch (what
/// F1 of the fidelity measures), all of them in each pass. Count, order, level and component stay; dots stay
/// on the surface and on toned surface. Returns the best of all passes, so by this measure the picture never
/// gets worse. The same bytes for any number of threads. Memory: about 1.5 kB for each pitch squared of
/// surface. Cost: about .5 CPU seconds a pass for 100,000 dots.
/// @throws InputError if the spot has no size or there is less than one pass.
DotSequence refine_dots(const SurfaceCurve& curve, const ToneField& tone, DotSequence dots,
                        const SpotModel& spot, const FineOptions& options = {},
                        const Progress& progress = {});

}  // namespace hilbrush
