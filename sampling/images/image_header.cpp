#include "sampling/images/image_header.h"

#include <zlib.h>

#include <algorithm>
#include <cstdint>

#include "sampling/base/text.h"

namespace hilbrush {
namespace {

using namespace std::string_view_literals;

/// A progressive JPEG is decoded once for each of its scans (ten are usual): the pixels of all its scans may
/// be this many times the limit of pixels.
constexpr std::size_t kMaxScans = 16;

/// What the header says; zero where it does not say, which the reader finds out.
struct Claim {
  std::size_t width = 0;
  std::size_t height = 0;
  std::size_t passes = 1;  ///< over all pixels
};

std::size_t byte_at(std::string_view bytes, std::size_t at) {
  return at < bytes.size() ? static_cast<unsigned char>(bytes[at]) : 0;
}
std::size_t little_endian(std::string_view bytes, std::size_t at, std::size_t count) {
  std::size_t value = 0;
  for (std::size_t i = count; i-- > 0;) value = value << 8 | byte_at(bytes, at + i);
  return value;
}
std::size_t big_endian(std::string_view bytes, std::size_t at, std::size_t count) {
  std::size_t value = 0;
  for (std::size_t i = 0; i < count; ++i) value = value << 8 | byte_at(bytes, at + i);
  return value;
}

Claim png_claim(std::string_view bytes) {
  return {big_endian(bytes, 16, 4), big_endian(bytes, 20, 4), 1};
}

/// Heights below zero are those of pictures that begin at the top.
Claim bmp_claim(std::string_view bytes) {
  constexpr std::size_t kCoreHeader = 12;
  if (little_endian(bytes, 14, 4) == kCoreHeader)
    return {little_endian(bytes, 18, 2), little_endian(bytes, 20, 2), 1};
  const auto size_of = [](std::size_t value) {
    return value <= 0x7fffffffu ? value : std::size_t{0x100000000u} - value;
  };
  return {size_of(little_endian(bytes, 18, 4)), size_of(little_endian(bytes, 22, 4)), 1};
}

Claim tga_claim(std::string_view bytes) {
  return {little_endian(bytes, 12, 2), little_endian(bytes, 14, 2), 1};
}

/// The canvas, and the first frame, which may be larger.
Claim gif_claim(std::string_view bytes) {
  Claim claim{little_endian(bytes, 6, 2), little_endian(bytes, 8, 2), 1};
  const auto colors = [](std::size_t flags) {
    return flags & 0x80u ? std::size_t{3} << ((flags & 7u) + 1) : 0;
  };
  std::size_t at = 13 + colors(byte_at(bytes, 10));
  while (byte_at(bytes, at) == 0x21) {  // extensions: a label, then blocks with their lengths, then none
    at += 2;
    while (const std::size_t length = byte_at(bytes, at)) at += length + 1;
    ++at;
  }
  if (byte_at(bytes, at) == 0x2c) {
    claim.width = std::max(claim.width, little_endian(bytes, at + 5, 2));
    claim.height = std::max(claim.height, little_endian(bytes, at + 7, 2));
  }
  return claim;
}

/// The size in the frame's header, and how many scans follow.
Claim jpeg_claim(std::string_view bytes) {
  Claim claim;
  std::size_t at = 2;
  while (at + 4 <= bytes.size() && byte_at(bytes, at) == 0xff) {
    const std::size_t marker = byte_at(bytes, at + 1);
    if (marker == 0xff) {  // a fill byte
      ++at;
      continue;
    }
    const bool is_frame =
        marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
    if (is_frame) {
      claim.height = std::max(claim.height, big_endian(bytes, at + 5, 2));
      claim.width = std::max(claim.width, big_endian(bytes, at + 7, 2));
    }
    if (marker == 0xda) break;
    at += 2 + big_endian(bytes, at + 2, 2);
  }
  // In a scan's data every FF is followed by 00 or a restart marker.
  claim.passes = 0;
  for (at = bytes.find("\xff\xda"sv, at); at != std::string_view::npos; at = bytes.find("\xff\xda"sv, at + 2))
    ++claim.passes;
  return claim;
}

/// libjpeg fills a truncated picture with gray and OpenImageIO calls that success; a whole one has an end
/// marker after its last scan.
bool is_truncated_jpeg(std::string_view bytes) {
  const std::size_t scan = bytes.rfind("\xff\xda"sv);
  return scan == std::string_view::npos || bytes.find("\xff\xd9"sv, scan) == std::string_view::npos;
}

/// What is wrong with a PNG's chain of chunks, or empty. libpng finds out as well, but writes to stderr
/// first.
std::string png_fault(std::string_view bytes) {
  constexpr std::size_t kFrame = 12;  // length, name, check sum
  for (std::size_t at = 8; at + kFrame <= bytes.size();) {
    const std::size_t length = big_endian(bytes, at, 4);
    if (length > bytes.size() - at - kFrame) break;
    const std::string_view named = bytes.substr(at + 4, 4 + length);
    if (crc32(0, reinterpret_cast<const Bytef*>(named.data()), static_cast<uInt>(named.size())) !=
        big_endian(bytes, at + 8 + length, 4))
      return "the PNG picture is corrupt";
    if (named.substr(0, 4) == "IEND") return "";
    at += kFrame + length;
  }
  return "the PNG picture is truncated";
}

Claim claim_of(const std::string& format, std::string_view bytes) {
  if (format == "png") return png_claim(bytes);
  if (format == "jpeg") return jpeg_claim(bytes);
  if (format == "gif") return gif_claim(bytes);
  if (format == "bmp") return bmp_claim(bytes);
  if (format == "targa") return tga_claim(bytes);
  return {};
}

}  // namespace

std::string image_format(const std::filesystem::path& file, std::string_view bytes) {
  if (bytes.starts_with("\x89PNG\r\n\x1a\n")) return "png";
  if (bytes.starts_with("\xff\xd8\xff")) return "jpeg";
  if (bytes.starts_with("GIF87a") || bytes.starts_with("GIF89a")) return "gif";
  if (bytes.starts_with("BM")) return "bmp";
  for (const std::string_view magic : {"II*\0"sv, "MM\0*"sv, "II+\0"sv, "MM\0+"sv})
    if (bytes.starts_with(magic)) return "tiff";
  const std::string ending = lower_case(file.extension().string());
  if (ending == ".tga" || ending == ".tpic") return "targa";
  return "";
}

std::string fault_before_decoding(const std::string& format, std::string_view bytes,
                                  std::size_t pixel_limit) {
  if (format.empty()) return "it is not a PNG, JPEG, GIF, TGA, BMP or TIFF picture";
  const Claim claim = claim_of(format, bytes);
  if (claim.width > kMaxSidePixels || claim.height > kMaxSidePixels ||
      claim.width * claim.height > pixel_limit)
    return too_many_pixels(claim.width, claim.height, pixel_limit);
  if (claim.width * claim.height * claim.passes > kMaxScans * pixel_limit)
    return "it stores its " + std::to_string(claim.width) + " x " + std::to_string(claim.height) +
           " pixels in " + std::to_string(claim.passes) +
           " scans, which take too long to decode; save it again";
  if (format == "jpeg" && is_truncated_jpeg(bytes)) return "the JPEG picture is truncated";
  if (format == "png") return png_fault(bytes);
  return "";
}

std::string too_many_pixels(std::size_t width, std::size_t height, std::size_t pixel_limit) {
  return "it has " + std::to_string(width) + " x " + std::to_string(height) +
         " pixels, more than the limit allows (" + std::to_string(pixel_limit) + " left)";
}

}  // namespace hilbrush
