#pragma once
#include <filesystem>
#include <string>

#include "planner/cell_description.h"
#include "sampling/tone.h"

/// Cell descriptions from JSON files, read strictly: every key is required unless its default is documented, unknown keys, wrong types, wrong
/// units (the unit is part of the key) and values out of range are InputErrors with the file and the JSON path.
namespace hilbrush {

CellDescription load_cell(const std::filesystem::path& file);

/// A path if `name` has a slash or ends in .json, else <cells folder>/<name>.json. The cells folder: $HILBRUSH_CELLS, or config/cells of the
/// source tree the program was built from, or ../share/hilbrush/cells beside the program. @throws InputError listing the known cells.
std::filesystem::path find_cell(const std::string& name);

/// The tone options that painting on this cell needs with this sampler; identity curve (and false in *is_calibrated) if the file has none.
ToneOptions tone_options(const CellDescription& cell, const std::string& sampler, bool* is_calibrated = nullptr);

}  // namespace hilbrush
