#include "sampling/place_dots.h"

#include "sampling/blue/blue.h"
#include "sampling/curve/stream_dots.h"

namespace hilbrush {

DotSequence place_dots(const SurfaceCurve& curve, const ToneField& tone, const SampleOptions& options,
                       SampleReport* report, const Progress& progress) {
  if (options.sampler == Sampler::kBlue) return place_blue(curve, tone, options, report, progress);
  return place_dots(CurveMass(curve, tone), options, report, progress);
}

}  // namespace hilbrush
