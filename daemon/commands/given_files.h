#pragma once
#include <cstddef>
#include <string>

/// Files named on the command line.
namespace hilbrush {

/// Largest size of a report or settings file.
inline constexpr std::size_t kReportBytesMax = 64u << 20;

/// The absolute path of a file that must exist. `what` names its kind in errors. @throws InputError
std::string existing_file(const std::string& file, const char* what);

/// The settings in the report.json beside a file that a job wrote; empty if there is no report or it has
/// none.
std::string settings_beside(const std::string& file);

}  // namespace hilbrush
