#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "planner/cell_model/cell_description.h"
#include "sampling/options/tone_options.h"

/// Cell descriptions from JSON files, read strictly. Every key is required unless its default is documented.
/// Unknown keys, wrong types, wrong units (the unit is part of the key) and values out of range are
/// InputErrors with the file and the JSON path.
namespace hilbrush {

CellDescription load_cell(const std::filesystem::path& file);

/// The same from the text of a file; `origin` names the file in errors.
CellDescription cell_from_json(const std::string& text, const std::string& origin);

/// What load_cell() accepts but is probably a mistake: one sentence each, starting with the JSON path.
std::vector<std::string> cell_warnings(const CellDescription& cell);

/// Taken as a path if `name` has a slash or ends in .json, else <cells folder>/<name>.json. The cells folder
/// is $HILBRUSH_CELLS, or ../share/hilbrush/cells beside the program, or config/cells of the source tree that
/// the program was built from. @throws InputError listing the known cells.
std::filesystem::path find_cell(const std::string& name);

/// The names of the cells in the cells folder, sorted.
std::vector<std::string> known_cells();

/// What a tone curve is valid for: how dots are placed, and the size of the spot at the job's pitch.
struct ToneCurveUse {
  std::string sampler, curve = "hilbert";
  int levels = 1;
  std::optional<double> spot_pitches = {};
};

/// The paint of a cell and its tone curve for one use.
struct CellTone {
  ToneOptions options;
  std::string warning;  ///< empty if the file has a curve for exactly this use
};

/// Of curves for several spots, takes that of the nearest spot, with a warning if it differs by more than a
/// tenth. If the file has no curve for the use, takes that of the same sampler and levels on the other
/// space-filling curve; if that is missing too, the identity. Both with a warning.
CellTone cell_tone(const CellDescription& cell, const ToneCurveUse& use);

}  // namespace hilbrush
