#pragma once
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "config/job_settings.h"
#include "planner/cell_model/cell_description.h"
#include "sim/film/calibrate.h"

/// A gray wedge for the real cell to paint, and the readings of its fields.
///
/// The card is flat: fields in rows and columns on white, with a black corner beside the first field. The
/// asked coverage of the fields increases along the rows, up to the cell's asked_max. Steps:
///   hilbrush calibrate --wedge -o W --sampler S --dpi D    writes W/wedge.wrl, W/wedge.json,
///   W/wedge_steps.json hilbrush submit W/wedge.wrl --settings W/wedge.json    paints it, on a flat, coated
///   card an operator measures each field and fills in wedge_steps.json hilbrush calibrate --measured
///   W/wedge_steps.json --settings W/wedge.json -o C    writes C/tone_curve.json
namespace hilbrush {

struct WedgeCard {
  static constexpr int kColumns = 4;
  static constexpr int kRows = 4;

  double field_m = 0;         ///< side of a field
  double gap_m = 0;           ///< width of the white around it
  std::vector<double> asked;  ///< coverage of each field, kColumns * kRows, increasing

  double width_m() const { return kColumns * field_m + (kColumns + 1) * gap_m; }
  double height_m() const { return kRows * field_m + (kRows + 1) * gap_m; }
};

/// Fields of 60 pitches, at least 10 mm: many dots wide, and large enough for densitometers and scanners.
WedgeCard wedge_card(double pitch_m, double asked_max, std::span<const double> levels);

/// The card as VRML 2.0, facing +y, in the cell's own white and black.
std::string wedge_model(const WedgeCard& card, const CellDescription::Paint& paint);

/// The job that paints it: `settings` with a linear tone curve and without everything that corrects the tone.
JobSettings wedge_settings(const JobSettings& settings);

/// The form to fill in: how to measure, and for each field its asked coverage, and `painted` still null.
std::string wedge_form(const WedgeCard& card, const JobSettings& settings);

/// Reads a form that was filled in: each step has `asked` and either `painted` (coverage, 0 to 1) or
/// `reflectance` (linear light; the cell's paint gives the reflectance of white and black).
/// @throws InputError with the JSON path for unknown keys, for steps without a reading, for a field that is
/// missing, for readings that fall where more was asked for, or that are all the same, and for a wedge that
/// was painted with other settings of placement than `settings`.
std::vector<WedgeStep> read_wedge_form(const std::filesystem::path& file, const JobSettings& settings,
                                       const CellDescription& cell);

}  // namespace hilbrush
