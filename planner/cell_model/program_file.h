#pragma once
#include <filesystem>
#include <stdexcept>
#include <string>

#include "planner/cell_model/exposure_program.h"

/// An exposure program as a binary little-endian PLY: element `vertex` (one an exposure: x y z nx ny nz tone
/// energy j1 j2 j3 j4 a c power pulse incidence dot), element `via` (before j1 j2 j3 j4 a c); provenance and
/// pitch in comments. The first comment holds the SHA-256 of every byte after its own line, so that every
/// change of header or body is detected. Opens in MeshLab, CloudCompare and Open3D as a point cloud. Lengths
/// in meters, angles in radians.
namespace hilbrush {

struct ProgramFileError : std::runtime_error {
  using std::runtime_error::runtime_error;  ///< "file: sentence"
};

/// Written to a temporary name and renamed, so a program file is complete or absent. @throws ProgramFileError
void write_program(const ExposureProgram& program, const std::filesystem::path& file);
/// @throws ProgramFileError if the file is not a program, is truncated, or its SHA-256 does not match.
ExposureProgram read_program(const std::filesystem::path& file);

}  // namespace hilbrush
