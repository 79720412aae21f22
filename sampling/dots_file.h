#pragma once
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "sampling/dots.h"

/// Dots as a file that people can look at: binary little-endian PLY, opens in MeshLab, CloudCompare and Open3D as a
/// point cloud.
namespace hilbrush {

/// Writes element `vertex` with x y z (metres, frame O), nx ny nz, tone, level, component, reason. `reasons` has one
/// code a dot, 0 = exposed; comments in the header give the name of each code and the pitch.
/// @throws InputError naming the file if it can't be written.
void write_dots(const DotSequence& sequence, std::span<const std::uint8_t> reasons,
                std::span<const std::string> reason_names, const std::filesystem::path& file);

}  // namespace hilbrush
