#pragma once
#include <filesystem>

#include "sampling/dots/dots.h"

/// Reads back what write_dots wrote.
namespace hilbrush {

/// Properties are found by name and may be of any PLY number type, in any order; unknown ones are skipped. x,
/// y and z are required; nx, ny, nz, tone, level and component are read if present. The triangle is not in
/// the file: it is 0. The pitch is that of the header's comment, or 0.
/// @throws InputError naming the file if it is not a binary little-endian PLY of points, or ends too soon.
DotSequence read_dots(const std::filesystem::path& file);

}  // namespace hilbrush
