#pragma once
#include <filesystem>
#include <string>

namespace hilbrush {

/// A folder of files shipped with the project: ../share/hilbrush/NAME beside the installed program, or
/// config/NAME of the source tree that the program was built from.
std::filesystem::path shipped_folder(const std::string& name);

}  // namespace hilbrush
