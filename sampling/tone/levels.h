#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "sampling/dots/dots.h"
#include "sampling/options/tone_options.h"
#include "sampling/tone/tone_field.h"

/// Several energies a dot may have. Each dot takes the smallest level that its tone needs: light places get
/// more, weaker dots, and less grain, dark places fewer and stronger ones, and the same picture needs fewer
/// dots. A level is enough while it needs no more than kEnoughDots a pitch squared.
///
/// Measured on flat fields (spot 1.41 pitches, saturating paint): grain is what light tones have (rms .05 at
/// tone .1 against .007 at .9), and most dots are spent on dark ones; energies of .8, 1.6 and 3 and .4 dots a
/// pitch squared came out best of those tried, for pictures full of white and for pictures full of grays.
namespace hilbrush {

inline constexpr int kMaxLevels = 4;
inline constexpr double kEnoughDots = .4;

/// The `count` energies (1 = blackens one pitch squared), rising, in proportion to asked_max, the most that a
/// tone curve may ask for. One level: dots of energy 1, as many as the tone asks for.
std::vector<double> energy_levels(int count, double asked_max);

/// The index of the smallest level that is enough for this much coverage.
std::size_t level_for(std::span<const double> levels, double asked);

/// Dots a pitch squared for this much coverage: asked over the smallest level that is enough.
double dots_for(std::span<const double> levels, double asked);

/// The curve for the number of dots where `curve` asks for coverage: asked / level, with `levels` as from
/// energy_levels(). Piecewise linear; it falls, over a narrow ramp, wherever the next level takes over.
ToneCurve density_curve(const ToneCurve& curve, std::span<const double> levels);

/// Gives each dot its level. `asked` is the field of the coverage asked for, `density` the one the dots were
/// placed by (its curve from density_curve()). A dot wants the energy asked for around it over the dots that
/// are there; what rounding to a level leaves is carried on along the curve: the energies of all dots add up
/// to what was asked, within one dot. One thread or many, same levels. Cost: two integrals a dot.
void assign_levels(DotSequence& dots, const ToneField& asked, const ToneField& density,
                   std::span<const double> levels);

}  // namespace hilbrush
