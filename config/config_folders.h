#pragma once
#include <filesystem>
#include <string>

namespace hilbrush {

/// Where what the project ships lies: `name` beside the installed program (../share/hilbrush/NAME), or in config/ of
/// the source tree the program was built from.
std::filesystem::path shipped_folder(const std::string& name);

}  // namespace hilbrush
