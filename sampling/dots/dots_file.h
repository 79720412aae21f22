#pragma once
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>

#include "sampling/dots/dots.h"

/// Dots as a file for viewers: binary little-endian PLY, opens in MeshLab, CloudCompare and Open3D as a point
/// cloud.
namespace hilbrush {

/// A file of a known number of dots that is written as they come: element `vertex` with x y z (meters, frame
/// O), nx ny nz, tone, level, component, reason; comments in the header give the name of each reason's code
/// and the pitch. Memory: one block of rows.
class DotsFile {
 public:
  /// @throws InputError naming the file if it cannot be opened for writing.
  DotsFile(const std::filesystem::path& file, double pitch_m, std::uint64_t dot_count,
           std::span<const std::string> reason_names);

  /// `reasons` has one code a dot, 0 = exposed; without any, all are 0.
  void add(std::span<const Dot> dots, std::span<const std::uint8_t> reasons = {});
  /// After the last dot. @throws InputError naming the file if it cannot be written.
  void close();

 private:
  std::filesystem::path file_;
  std::ofstream out_;
  std::uint64_t missing_;
};

/// All in one.
void write_dots(const DotSequence& sequence, std::span<const std::uint8_t> reasons,
                std::span<const std::string> reason_names, const std::filesystem::path& file);

}  // namespace hilbrush
