#pragma once
#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "sampling/base/result.h"
#include "sampling/model/textured_mesh.h"

/// Model files in: VRML 2.0 (and the common part of 1.0) in vrml/, OBJ+MTL, PLY, OFF and STL in files/, by
/// readers of our own. The kind is found from the first bytes, then from the name's ending. All bytes are
/// untrusted.
namespace hilbrush {

/// What untrusted input may cost. To exceed a limit is an InputError that names it.
struct ModelLimits {
  std::size_t file_bytes = 256u << 20;  ///< each file, after gunzip
  std::size_t nodes = 2'000'000;        ///< VRML nodes, after USE and PROTO are expanded
  std::size_t values = 32'000'000;  ///< numbers in the nodes' fields (a field and a string count as several)
  int depth = 64;                   ///< nesting of nodes, PROTOs and Inlines
  std::size_t triangles = 4'000'000;
  std::size_t image_pixels = 64u << 20;  ///< all images of the model together
};

/// Reads one image file, or says why not. load_image_file() of sampling_images is the real one.
using ImageReader =
    std::function<Result<Texture>(const std::filesystem::path& file, std::size_t pixel_limit)>;

enum class UpAxis { kY, kZ };

struct Model {
  TexturedMesh mesh;             ///< in the file's own units and axes
  std::optional<double> unit_m;  ///< meters of one unit of the file, where the format says (VRML: 1)
  UpAxis up = UpAxis::kZ;        ///< usual for the format: VRML and OBJ y, STL and PLY and OFF z
  std::vector<std::string>
      warnings;  ///< missing textures with the names tried, ignored nodes, dropped faces, ...
  std::vector<std::filesystem::path>
      files;  ///< everything that was read: the model, inlines, material files, images
};

/// Reads `file`; other files are only read from its folder or below. Textures that cannot be read are
/// warnings, not errors.
/// @throws InputError with at() = "file:line" (or "file") if there is no usable geometry or a limit is
/// exceeded.
Model load_model(const std::filesystem::path& file, const ImageReader& read_image,
                 const ModelLimits& limits = {});

}  // namespace hilbrush
