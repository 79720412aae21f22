#pragma once
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

/// What a picture's first bytes say, read before OpenImageIO sees the file: several of its readers allocate
/// or unpack the whole picture when they open it, for a size that only the header claims.
namespace hilbrush {

/// Width and height, in pixels, that are read at most.
inline constexpr std::size_t kMaxSidePixels = std::size_t{1} << 16;

/// OpenImageIO's name of the file's format by its first bytes (TGA has no signature: by its ending), or
/// empty. Choosing the plug-in ourselves keeps the hundred other formats it knows away from untrusted bytes.
std::string image_format(const std::filesystem::path& file, std::string_view bytes);

/// Why OpenImageIO must not see the bytes, or empty: an unknown format, a truncated or corrupt file that it
/// would call a success, or more work than `pixel_limit` pixels are worth. A TIFF's sizes are checked after
/// opening, as its header may stand anywhere and opening allocates nothing.
std::string fault_before_decoding(const std::string& format, std::string_view bytes, std::size_t pixel_limit);

/// The message for a picture that is too large.
std::string too_many_pixels(std::size_t width, std::size_t height, std::size_t pixel_limit);

}  // namespace hilbrush
