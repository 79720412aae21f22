#pragma once
#include <cstddef>
#include <string>

/// Files that an operator names on the command line.
namespace hilbrush {

/// Of a report or a settings file.
inline constexpr std::size_t kReportBytesMax = 64u << 20;

/// The absolute path of a file that must be there. @throws InputError naming it as a `what`.
std::string existing_file(const std::string& file, const char* what);

/// The settings in the report.json beside a file that a job made; empty if there is no report or it has none.
std::string settings_beside(const std::string& file);

}  // namespace hilbrush
