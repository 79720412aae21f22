#include "sampling/images/image_file.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <mutex>
#include <utility>

#include "sampling/base/input_error.h"
#include "sampling/base/text.h"
#include "sampling/images/image_header.h"

namespace hilbrush {
namespace {

using std::filesystem::path;

constexpr std::size_t kStripRows = 64;  ///< read at once: bounds the memory beside the texture's own
/// A picture as its file has it, unpacked: interlaced and progressive ones are unpacked whole. 64 Mpixels of
/// 4 channels of 16 bits, or of 2 in floating point.
constexpr std::size_t kMaxImageBytes = std::size_t{512} << 20;
constexpr std::size_t kMaxTileBytes = std::size_t{64} << 20;  ///< 4096 x 4096 pixels of 4 bytes
/// None, CCITT (2 to 4), LZW, JPEG, deflate (its two numbers), packed bits. The others (LERC, JBIG, WebP,
/// Zstandard,
/// ...) unpack to a size that stands in their own stream, and no exporter of textures uses them.
constexpr std::array kTiffCompressions{1, 2, 3, 4, 5, 7, 8, 32773, 32946};

double srgb_to_linear(double encoded) {
  return encoded <= .04045 ? encoded / 12.92 : std::pow((encoded + .055) / 1.055, 2.4);
}

/// Linear light of every 16-bit sRGB code; 8-bit codes are the multiples of 257.
const std::vector<float>& linear_of_code() {
  static const std::vector<float> table = [] {
    std::vector<float> values(65536);
    for (std::size_t i = 0; i < values.size(); ++i)
      values[i] = static_cast<float>(srgb_to_linear(static_cast<double>(i) / 65535.));
    return values;
  }();
  return table;
}

Result<std::string> read_bytes(const path& file, std::size_t limit) {
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (error || !std::filesystem::exists(status)) return Failure{"there is no such file"};
  if (!std::filesystem::is_regular_file(status)) return Failure{"it is not a regular file"};
  const auto size = std::filesystem::file_size(file, error);
  if (error) return Failure{"its size cannot be read"};
  if (size > limit) return Failure{"the file is larger than " + std::to_string(limit >> 20) + " MB"};
  std::ifstream in(file, std::ios::binary);
  std::string bytes(size, '\0');
  if (!in.read(bytes.data(), static_cast<std::streamsize>(size))) return Failure{"it cannot be read"};
  return bytes;
}

/// A TIFF's tile is decoded in one piece, whatever part of it the picture needs.
std::string tiff_fault(const OIIO::ImageSpec& spec) {
  const std::size_t tile_bytes = spec.tile_width > 0 ? spec.tile_bytes(true) : 0;
  if (tile_bytes > kMaxTileBytes)
    return "its tiles of " + std::to_string(spec.tile_width) + " x " + std::to_string(spec.tile_height) +
           " pixels take " + number(static_cast<double>(tile_bytes) / (1 << 20)) +
           " MB each, more than the " + std::to_string(kMaxTileBytes >> 20) +
           " MB allowed; save it in strips or smaller tiles";
  const int compression = spec.get_int_attribute("tiff:Compression", 1);
  if (std::ranges::find(kTiffCompressions, compression) == kTiffCompressions.end())
    return "its compression (TIFF's number " + std::to_string(compression) +
           ") is not read; save it uncompressed or with LZW or deflate";
  return "";
}

/// What is wrong with the header, or empty.
std::string header_fault(const OIIO::ImageSpec& spec, std::size_t pixel_limit) {
  if (spec.width < 1 || spec.height < 1 || spec.depth > 1) return "it is not a flat picture";
  const auto width = static_cast<std::size_t>(spec.width);
  const auto height = static_cast<std::size_t>(spec.height);
  if (width > kMaxSidePixels || height > kMaxSidePixels || width * height > pixel_limit)
    return too_many_pixels(width, height, pixel_limit);
  const std::string color_space = lower_case(spec.get_string_attribute("jpeg:ColorSpace"));
  if (color_space == "cmyk" || color_space == "ycck" ||
      lower_case(spec.get_string_attribute("tiff:ColorSpace")) == "cmyk")
    return "its colors are CMYK, which have no agreed meaning on screen; save it as RGB";
  if (spec.nchannels < 1 || spec.nchannels > 4)
    return "it has " + std::to_string(spec.nchannels) + " channels; 1 to 4 are read";
  if (spec.image_bytes(true) > kMaxImageBytes)
    return "it unpacks to " + std::to_string(spec.image_bytes(true) >> 20) + " MB, more than the " +
           std::to_string(kMaxImageBytes >> 20) + " MB allowed";
  return tiff_fault(spec);
}

/// Turns strips of interleaved channels into rows of the texture, bottom row first.
class TextureFiller {
 public:
  TextureFiller(Texture& texture, bool is_linear) : texture_(texture), is_linear_(is_linear) {
    const std::size_t count =
        static_cast<std::size_t>(texture.width) * static_cast<std::size_t>(texture.height);
    texture_.luminance.resize(count);
    if (texture.channels % 2 == 0) texture_.opacity.resize(count);
  }

  void set(int x, int row_from_top, const std::uint16_t* codes) {
    const std::vector<float>& table = linear_of_code();
    const auto linear = [&](int c) { return table[codes[c]]; };
    store(x, row_from_top, linear, codes[texture_.channels - 1] / 65535.f);
  }
  void set(int x, int row_from_top, const float* values) {
    const auto clamped = [&](int c) {
      return std::isfinite(values[c]) ? std::clamp(values[c], 0.f, 1.f) : 0.f;
    };
    const auto linear = [&](int c) {
      return is_linear_ ? clamped(c) : static_cast<float>(srgb_to_linear(clamped(c)));
    };
    store(x, row_from_top, linear, clamped(texture_.channels - 1));
  }
  /// An image without a transparent pixel is opaque.
  void finish() {
    if (std::all_of(texture_.opacity.begin(), texture_.opacity.end(), [](float a) { return a >= 1; }))
      texture_.opacity.clear();
  }

 private:
  template <class Linear>
  void store(int x, int row_from_top, const Linear& linear, float alpha) {
    const std::size_t at = static_cast<std::size_t>(texture_.height - 1 - row_from_top) *
                               static_cast<std::size_t>(texture_.width) +
                           static_cast<std::size_t>(x);
    texture_.luminance[at] =
        texture_.channels < 3 ? linear(0) : .2126f * linear(0) + .7152f * linear(1) + .0722f * linear(2);
    if (!texture_.opacity.empty()) texture_.opacity[at] = alpha;
  }

  Texture& texture_;
  bool is_linear_;
};

template <class Value>
bool read_rows(OIIO::ImageInput& input, const OIIO::ImageSpec& spec, OIIO::TypeDesc type,
               TextureFiller& filler) {
  // A tiled file is read by whole rows of tiles.
  const int step = spec.tile_height > 0 ? spec.tile_height : static_cast<int>(kStripRows);
  const auto channels = static_cast<std::size_t>(spec.nchannels);
  std::vector<Value> strip(static_cast<std::size_t>(std::min(step, spec.height)) *
                           static_cast<std::size_t>(spec.width) * channels);
  for (int y = 0; y < spec.height; y += step) {
    const int end = std::min(y + step, spec.height);
    const bool ok =
        spec.tile_width > 0
            ? input.read_tiles(0, 0, spec.x, spec.x + spec.width, spec.y + y, spec.y + end, 0, 1, 0,
                               spec.nchannels, type, strip.data())
            : input.read_scanlines(0, 0, spec.y + y, spec.y + end, 0, 0, spec.nchannels, type, strip.data());
    if (!ok || input.has_error()) return false;
    for (int row = y; row < end; ++row)
      for (int x = 0; x < spec.width; ++x)
        filler.set(x, row,
                   &strip[(static_cast<std::size_t>(row - y) * static_cast<std::size_t>(spec.width) +
                           static_cast<std::size_t>(x)) *
                          channels]);
  }
  return true;
}

/// OpenImageIO's messages may span lines; a reason is one line.
std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

/// @throws what OpenImageIO throws
Result<Texture> decode(const path& file, const std::string& format, std::size_t pixel_limit) {
  auto input = OIIO::ImageInput::create(format);
  OIIO::ImageSpec spec;
  OIIO::ImageSpec config;
  config["oiio:UnassociatedAlpha"] = 1;
  if (!input || !input->open(file.string(), spec, config)) {
    const std::string fault = input ? input->geterror() : OIIO::geterror();
    return Failure{"the " + format + " picture cannot be read: " + one_line(fault)};
  }
  if (std::string fault = header_fault(spec, pixel_limit); !fault.empty()) return Failure{std::move(fault)};
  Texture texture;
  texture.width = spec.width;
  texture.height = spec.height;
  texture.channels = spec.nchannels;
  texture.name = file.filename().string();
  const bool is_float = spec.format.is_floating_point();
  TextureFiller filler(texture, is_float);
  const bool ok = is_float ? read_rows<float>(*input, spec, OIIO::TypeDesc::FLOAT, filler)
                           : read_rows<std::uint16_t>(*input, spec, OIIO::TypeDesc::UINT16, filler);
  const std::string fault = input->geterror();
  input->close();
  if (!ok || !fault.empty())
    return Failure{"the " + format + " picture is truncated or corrupt: " + one_line(fault)};
  filler.finish();
  return texture;
}

}  // namespace

Result<Texture> load_image_file(const path& file, std::size_t pixel_limit) {
  static std::once_flag limits_set;
  std::call_once(limits_set, [] { OIIO::attribute("limits:imagesize_MB", 512); });

  // No useful picture has more than 16 bytes a pixel in its file, but small ones may carry metadata.
  const auto bytes =
      read_bytes(file, (std::size_t{16} << 20) + 16 * std::min<std::size_t>(pixel_limit, 16u << 20));
  if (!bytes) return Failure{bytes.reason()};
  const std::string format = image_format(file, *bytes);
  if (std::string fault = fault_before_decoding(format, *bytes, pixel_limit); !fault.empty())
    return Failure{std::move(fault)};
  try {
    return decode(file, format, pixel_limit);
  } catch (const std::exception& error) {
    return Failure{std::string("the picture cannot be read: ") + one_line(error.what())};
  }
}

void save_png(const Picture& picture, const path& file) {
  const std::size_t wanted = static_cast<std::size_t>(std::max(picture.width, 0)) *
                             static_cast<std::size_t>(std::max(picture.height, 0)) *
                             static_cast<std::size_t>(std::max(picture.channels, 0));
  if (wanted == 0 || (picture.channels != 1 && picture.channels != 3) || picture.pixels.size() != wanted)
    throw InputError(file.string(), "a picture of " + std::to_string(picture.width) + " x " +
                                        std::to_string(picture.height) + " x " +
                                        std::to_string(picture.channels) + " with " +
                                        std::to_string(picture.pixels.size()) + " bytes cannot be written");
  auto output = OIIO::ImageOutput::create("png");
  OIIO::ImageSpec spec(picture.width, picture.height, picture.channels, OIIO::TypeDesc::UINT8);
  spec.attribute("oiio:ColorSpace", "sRGB");
  if (!output) throw InputError(file.string(), "cannot be written: " + one_line(OIIO::geterror()));
  const bool ok = output->open(file.string(), spec) &&
                  output->write_image(OIIO::TypeDesc::UINT8, picture.pixels.data()) && output->close();
  if (!ok) throw InputError(file.string(), "cannot be written: " + one_line(output->geterror()));
}

}  // namespace hilbrush
