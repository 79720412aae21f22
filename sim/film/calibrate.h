#pragma once
#include <functional>
#include <span>
#include <vector>

#include "planner/cell_model/cell_description.h"
#include "sampling/options/tone_options.h"
#include "sampling/place_picture.h"

/// From a gray wedge to a tone curve (README, "Tone"). The wedge is a flat strip of 11 or more steps; each is
/// painted and its mean coverage read.
namespace hilbrush {

struct WedgeStep {
  double asked = 0;    ///< coverage asked of the paint
  double painted = 0;  ///< mean coverage read back
};

/// Paints and reads the steps of a wedge; wedge_on_film() simulates it, a real one is measured by hand.
using Wedge = std::function<std::vector<WedgeStep>(const std::vector<double>& asked)>;

/// The wedge of the simulated film: each step is a field of flat surface on which `options` place dots at
/// this pitch (whose own pitch, count and predictive rounds are ignored), exposed at normal incidence and
/// read without its border. Keeps a reference to `cell`.
Wedge wedge_on_film(const CellDescription& cell, double pitch_m, const PictureOptions& options);

/// Inverts the wedge's response: for the wanted tones 0, .1 .. .9, 1 and, where the paint's response bends
/// most, .05, .75, .85, .95 and .98 the coverage to ask for, at most asked_max. Paints up to six wedges, each
/// with the values that the ones before suggest, until every step that can be reached reads within .003 of
/// what is wanted.
/// @throws InputError if the wedge has too few readings or shows no paint at all.
ToneCurve calibrate_tone(const Wedge& wedge, double asked_max);

/// The steps that a wedge for these levels should have: `shares` of asked_max, some moved so that each
/// level's last tone is among them.
std::vector<double> wedge_steps(std::vector<double> shares, double asked_max, std::span<const double> levels);

/// The curve from a wedge that was painted and measured once, linear between its steps. With several levels
/// (sampling/tone/levels.h) each has steps of its own, and where the next level takes over the curve jumps:
/// the same energy in fewer, stronger dots covers less.
/// @throws InputError if it has fewer than five steps, or shows no paint at all.
ToneCurve tone_curve_of(const std::vector<WedgeStep>& steps, double asked_max,
                        std::span<const double> levels);

}  // namespace hilbrush
