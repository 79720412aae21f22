#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "planner/cell_model/cell_description.h"
#include "sampling/options/tone_options.h"

/// Cell descriptions from JSON files, read strictly: every key is required unless its default is documented, unknown
/// keys, wrong types, wrong units (the unit is part of the key) and values out of range are InputErrors with the file
/// and the JSON path.
namespace hilbrush {

CellDescription load_cell(const std::filesystem::path& file);

/// The same from the file's text; `origin` names it in errors.
CellDescription cell_from_json(const std::string& text, const std::string& origin);

/// What load_cell accepts but is probably not meant: one sentence each, starting with the JSON path.
std::vector<std::string> cell_warnings(const CellDescription& cell);

/// A path if `name` has a slash or ends in .json, else <cells folder>/<name>.json. The cells folder: $HILBRUSH_CELLS,
/// or ../share/hilbrush/cells beside the program, or config/cells of the source tree the program was built from.
/// @throws InputError listing the known cells.
std::filesystem::path find_cell(const std::string& name);

/// The names of the cells in the cells folder, sorted.
std::vector<std::string> known_cells();

/// What a tone curve is good for: how dots are placed, and the size of the spot at the job's pitch.
struct ToneCurveUse {
  std::string sampler, curve = "hilbert";
  int levels = 1;
  std::optional<double> spot_pitches = {};
};

/// Paint and tone curve for that use. Of several spots the nearest one's curve is taken. If the file has none for the
/// use, that of the same sampler and levels on the other space-filling curve, else none at all; `warning` says
/// so, and if the spot is another by more than a tenth. It is left empty if all is well.
ToneOptions tone_options(const CellDescription& cell, const ToneCurveUse& use, std::string& warning);

/// The tone options that painting on this cell needs with this sampler; identity curve (and false in *is_calibrated) if
/// the file has none.
ToneOptions tone_options(const CellDescription& cell, const std::string& sampler, bool* is_calibrated = nullptr);

}  // namespace hilbrush
