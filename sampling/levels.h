#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "sampling/dots.h"
#include "sampling/tone.h"
#include "sampling/tone_field.h"

/// Several energies a dot may have. Each dot takes the smallest level that its tone needs, so that nowhere more than
/// one dot a pitch squared is wanted: dark places get stronger dots instead of more of them, light places weaker dots
/// instead of fewer, and the same picture needs fewer dots.
namespace hilbrush {

inline constexpr int kMostLevels = 4;

/// The `count` energies (1 = blackens one pitch squared), rising; the last one is asked_max, the most that a tone curve
/// may ask for. One level: dots of energy 1, as many as the tone asks for.
std::vector<double> energy_levels(int count, double asked_max);

/// Dots a pitch squared for this much coverage: asked over the smallest level that is enough.
double dots_for(std::span<const double> levels, double asked);

/// The curve for the number of dots where `curve` asks for coverage: asked / level, with `levels` as from
/// energy_levels(). Piecewise linear; it falls, over a narrow ramp, wherever the next level takes over.
ToneCurve density_curve(const ToneCurve& curve, std::span<const double> levels);

/// Gives each dot its level. `asked` is the field of the coverage asked for, `density` the one the dots were placed by
/// (its curve from density_curve()). A dot wants the energy asked for around it over the dots that are there; what
/// rounding to a level leaves is carried on along the curve, so that the energies of any stretch add up to what was
/// asked within one dot. One thread or many, same levels. Cost: two integrals a dot.
void assign_levels(DotSequence& dots, const ToneField& asked, const ToneField& density, std::span<const double> levels);

}  // namespace hilbrush
