#pragma once
#include <string>
#include <vector>

#include "sampling/base/enum_names.h"

/// Options of the tone: what the paint can show and what must be asked of it. No mesh and no picture, so that
/// config/ can read them.
namespace hilbrush {

/// Asked coverage for wanted coverage, both 0 = white, 1 = one full dot a pitch squared; undoes dot gain.
/// Piecewise linear. `asked` may exceed 1: where the paint needs more than one dot's energy a pitch squared
/// to be black.
struct ToneCurve {
  std::vector<double> wanted;  ///< strictly rising from 0 to 1
  std::vector<double> asked;   ///< rising, same length; both empty: identity

  double operator()(double coverage) const;
  /// The wanted coverage for which the curve asks this much; where `asked` stays level, the start of that
  /// part.
  double inverse(double asked_coverage) const;
};

/// What to do with surface that has neither texture nor colors.
enum class Untextured {
  kAuto,     ///< blank if any other part has texture or colors, else its material is painted
  kBlank,    ///< never painted
  kMaterial  ///< its material is painted
};

inline constexpr EnumName<Untextured> kUntexturedNames[] = {
    {Untextured::kAuto, "auto"},
    {Untextured::kBlank, "blank"},
    {Untextured::kMaterial, "material"},
};

inline const char* untextured_name(Untextured untextured) {
  return name_of(kUntexturedNames, untextured);
}

struct ToneOptions {
  double reflectance_white = 1;  ///< linear-light reflectance of unexposed paint ...
  double reflectance_black = 0;  ///< ... and of fully exposed paint (Murray-Davies)
  Untextured untextured = Untextured::kAuto;
  ToneCurve curve;
  /// Of the dots: the curve holds for the mean coverage over about a pitch (tone/pitch_mean.h). 0: for every
  /// texel.
  double pitch_m = 0;
};

}  // namespace hilbrush
