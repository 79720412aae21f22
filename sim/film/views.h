#pragma once
#include <filesystem>
#include <span>
#include <vector>

#include "sampling/images/image_file.h"
#include "sampling/tone_field.h"
#include "sim/film/film.h"

/// Pictures for people: orthographic views of the object, wanted | painted | error, and the contact sheet of them all.
namespace hilbrush {

/// Writes views/<name>.png (wanted | painted | error side by side, name = front, back, left, right, top, bottom) and
/// exposure.png (contact sheet, captioned) into `folder`. `skipped_O` are the positions of skipped dots, marked in red.
/// Returns the files written.
std::vector<std::filesystem::path> write_pictures(const Film& film, const ToneField& tone,
                                                  std::span<const Eigen::Vector3d> skipped_O,
                                                  const std::filesystem::path& folder, const Progress& progress = {});

}  // namespace hilbrush
