#pragma once
#include <array>
#include <filesystem>
#include <span>
#include <vector>

#include "sampling/images/image_file.h"
#include "sampling/tone/tone_field.h"
#include "sim/film/film.h"
#include "sim/film/orthographic_view.h"

/// Pictures for people: orthographic views of the object, wanted | painted | error, and the contact sheet of
/// them all.
namespace hilbrush {

/// The six views, in the object frame O (+z up): front is seen from -y, with x to the right; right from +x;
/// back from +y; left from -x; top from +z, with the front at the bottom of the picture; bottom from -z, with
/// the front at its top.
std::array<ViewDirection, 6> picture_views();

/// Writes views/<name>.png (wanted | painted | error side by side, name = front, right, back, left, top,
/// bottom) and exposure.png (contact sheet, captioned) into `folder`. `skipped_O` are the positions of
/// skipped dots, marked in red where they are seen. Coverage is shown as the reflectance of the paint,
/// relative to unpainted; the error as the Gaussian mean over a pitch of painted - wanted, orange where too
/// dark, blue where too light, in full color at .2. Faces seen from behind, which carry no film, are brown.
/// Returns the files written. @throws InputError naming a file that cannot be written.
std::vector<std::filesystem::path> write_pictures(const Film& film, const ToneField& tone,
                                                  std::span<const Eigen::Vector3d> skipped_O,
                                                  const std::filesystem::path& folder,
                                                  const Progress& progress = {});

}  // namespace hilbrush
