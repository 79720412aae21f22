#pragma once
#include <functional>
#include <vector>

#include "planner/cell_description.h"
#include "sampling/tone.h"

/// From a grey wedge to a tone curve (README, "Tone"). The wedge is a flat strip of 11 or more steps; each is painted
/// and its mean coverage read.
namespace hilbrush {

struct WedgeStep {
  double asked = 0;    ///< coverage asked of the paint
  double painted = 0;  ///< mean coverage read back
};

/// Paints and reads the steps of a wedge; the simulated one is wedge_on_film(), a real one is measured by hand.
using Wedge = std::function<std::vector<WedgeStep>(const std::vector<double>& asked)>;

/// Inverts the wedge's response: for 11 wanted tones (0, .1 .. 1) the coverage to ask for, at most asked_max. Repeats
/// with refined steps.
ToneCurve calibrate_tone(const Wedge& wedge, double asked_max);

}  // namespace hilbrush
