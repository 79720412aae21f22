#pragma once
#include <optional>

#include "sampling/model/model_file.h"

/// From the file's frame and units to the object frame O: meters, +z up, standing on z = 0, centered on the
/// rotation axis C.
namespace hilbrush {

struct PlacementOptions {
  std::optional<double> size_m = {};  ///< scale so that the longest side of the bounding box is this long
  std::optional<double> unit_m = {};  ///< or: meters of one unit of the file
  std::optional<UpAxis> up = {};      ///< default: that of the format
};

/// @throws InputError if neither the options nor the file say how large the object is (the sentence names
/// both options), if they contradict each other, or if the result has no extent or exceeds 2 m.
TexturedMesh place_on_table(const Model& model, const PlacementOptions& options);

}  // namespace hilbrush
