#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "sampling/base/result.h"
#include "sampling/model/textured_mesh.h"

/// Image files through OpenImageIO; the only code that uses it.
namespace hilbrush {

/// An ImageReader (see model_file.h): PNG, JPEG, GIF, TGA, BMP, TIFF; sRGB to linear light; luminance by Rec.
/// 709. Truncated and corrupt files are refused even where OpenImageIO reports success.
Result<Texture> load_image_file(const std::filesystem::path& file, std::size_t pixel_limit);

/// An 8-bit sRGB-encoded picture for people, row 0 at the top. channels is 1 or 3.
struct Picture {
  int width = 0;
  int height = 0;
  int channels = 1;
  std::vector<std::uint8_t> pixels;
};

/// Writes a PNG. @throws InputError naming the file if it cannot be written.
void save_png(const Picture& picture, const std::filesystem::path& file);

}  // namespace hilbrush
