#pragma once
#include <filesystem>
#include <string>

#include "drivers/device_options.h"

/// Register maps of positioning drives, as data: the meaning of each register, and the steps of each
/// handshake. Shipped maps are in config/axes; `config/axes/cia402.json` shows every key.
namespace hilbrush {

/// @throws InputError with the JSON path.
RegisterMap register_map_from_json(const std::string& text, const std::string& origin);
RegisterMap load_register_map(const std::filesystem::path& file);

/// Taken as a path (a relative one starts at `cell_folder`) if `name` has a slash or ends in .json, else the
/// shipped map of that name. @throws InputError at `at`, listing the known maps.
std::filesystem::path find_register_map(const std::string& name, const std::filesystem::path& cell_folder,
                                        const std::string& at);

}  // namespace hilbrush
