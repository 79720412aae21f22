#pragma once
#include <array>
#include <optional>

/// The fixture of one job and where the object sits on it. Std only, so that config/ can read it.
namespace hilbrush {

struct MountingOptions {
  std::optional<double> post_height_m, post_radius_m, plate_radius_m;  ///< unset: the cell's
  std::array<double, 3> offset_m{};  ///< of the object from the middle of the post's top, in O
  double turn = 0;                   ///< of the object about the post before it is shifted, rad
};

}  // namespace hilbrush
