#include "sampling/images/image_file.h"

#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <cmath>
#include <iterator>

#include "tests/sampling/model/model_on_disk.h"

namespace hilbrush {
namespace {

namespace fs = std::filesystem;

/// 3 x 2: red, green, blue above white, black, mid gray.
const std::vector<std::uint8_t> kPixels{255, 0,   0,   0, 255, 0, 0,   0,   255,
                                        255, 255, 255, 0, 0,   0, 128, 128, 128};

template <class Value>
fs::path save(const ModelOnDisk& disk, const std::string& name, int width, int height, int channels,
              const std::vector<Value>& pixels, OIIO::TypeDesc type = OIIO::TypeDesc::UINT8) {
  const fs::path file = disk.folder() / name;
  auto output = OIIO::ImageOutput::create(file.string());
  OIIO::ImageSpec spec(width, height, channels, type);
  spec.attribute("CompressionQuality", 100);
  spec.attribute("jpeg:subsampling", "4:4:4");
  EXPECT_TRUE(output && output->open(file.string(), spec) && output->write_image(type, pixels.data()) &&
              output->close())
      << name;
  return file;
}

std::string bytes_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(ImageFile, EveryFormatGivesLinearLightWithTheBottomRowFirst) {
  const ModelOnDisk disk;
  for (const char* name : {"a.png", "a.jpg", "a.gif", "a.tga", "a.bmp", "a.tif"}) {
    const auto texture = load_image_file(save(disk, name, 3, 2, 3, kPixels), 1000);
    ASSERT_TRUE(texture) << name << ": " << texture.reason();
    EXPECT_EQ(texture->width, 3);
    EXPECT_EQ(texture->height, 2);
    const double tolerance = std::string(name) == "a.jpg" ? .03 : 1e-3;
    const std::array<double, 6> wanted{1, 0, .21586, .2126, .7152, .0722};
    for (std::size_t i = 0; i < 6; ++i)
      EXPECT_NEAR(texture->luminance[i], wanted[i], tolerance) << name << " texel " << i;
    EXPECT_TRUE(texture->opacity.empty()) << name << " has no transparent pixel";
    EXPECT_EQ(texture->name, name);
  }
}

TEST(ImageFile, KeepsChannelsAlphaAndSixteenBits) {
  const ModelOnDisk disk;
  auto texture = load_image_file(save<std::uint8_t>(disk, "g.png", 2, 1, 1, {0, 128}), 1000);
  ASSERT_TRUE(texture) << texture.reason();
  EXPECT_EQ(texture->channels, 1);
  EXPECT_NEAR(texture->luminance[1], .21586, 1e-4);
  texture = load_image_file(save<std::uint8_t>(disk, "ga.png", 2, 1, 2, {255, 0, 255, 51}), 1000);
  ASSERT_TRUE(texture) << texture.reason();
  EXPECT_EQ(texture->channels, 2);
  EXPECT_NEAR(texture->opacity.at(1), .2, 1e-4);
  EXPECT_NEAR(texture->luminance[1], 1, 1e-4) << "color is not multiplied by alpha";
  texture = load_image_file(save<std::uint8_t>(disk, "rgba.png", 1, 1, 4, {255, 255, 255, 0}), 1000);
  ASSERT_TRUE(texture) << texture.reason();
  EXPECT_EQ(texture->channels, 4);
  EXPECT_EQ(texture->opacity.at(0), 0);
  texture = load_image_file(
      save<std::uint16_t>(disk, "deep.png", 1, 1, 3, {32768, 32768, 32768}, OIIO::TypeDesc::UINT16), 1000);
  ASSERT_TRUE(texture) << texture.reason();
  EXPECT_NEAR(texture->luminance[0], .2140, 1e-3);
  texture =
      load_image_file(save<float>(disk, "linear.tif", 1, 1, 3, {.5f, .5f, .5f}, OIIO::TypeDesc::FLOAT), 1000);
  ASSERT_TRUE(texture) << texture.reason();
  EXPECT_NEAR(texture->luminance[0], .5, 1e-6) << "a picture in floating point is linear already";
}

TEST(ImageFile, IsKnownByItsFirstBytesNotByItsName) {
  const ModelOnDisk disk;
  const fs::path png = save(disk, "a.png", 3, 2, 3, kPixels);
  EXPECT_EQ(load_image_file(disk.write("really.jpg", bytes_of(png)), 1000).reason(), "");
  EXPECT_EQ(load_image_file(disk.write("words.png", "no picture"), 1000).reason(),
            "it is not a PNG, JPEG, GIF, TGA, BMP or TIFF picture");
  EXPECT_EQ(load_image_file(disk.folder() / "nowhere.png", 1000).reason(), "there is no such file");
  EXPECT_EQ(load_image_file(disk.folder(), 1000).reason(), "it is not a regular file");
}

TEST(ImageFile, RefusesMorePixelsThanAllowed) {
  const ModelOnDisk disk;
  for (const char* name : {"a.png", "a.jpg", "a.gif", "a.tga", "a.bmp", "a.tif"}) {
    const auto texture = load_image_file(save(disk, name, 3, 2, 3, kPixels), 5);
    EXPECT_FALSE(texture) << name;
    EXPECT_NE(texture.reason().find("pixels"), std::string::npos) << name << ": " << texture.reason();
  }
}

TEST(ImageFile, RefusesTruncatedFiles) {
  const ModelOnDisk disk;
  std::vector<std::uint8_t> noise(64 * 64 * 3);
  for (std::size_t i = 0; i < noise.size(); ++i)
    noise[i] = static_cast<std::uint8_t>((i * 2654435761u) >> 13);
  for (const char* name : {"a.png", "a.jpg", "a.gif", "a.tga", "a.bmp", "a.tif"}) {
    const std::string bytes = bytes_of(save(disk, name, 64, 64, 3, noise));
    for (const double share : {.02, .3, .6, .9}) {
      const auto size = static_cast<std::size_t>(share * static_cast<double>(bytes.size()));
      const auto texture =
          load_image_file(disk.write(std::string("cut_") + name, bytes.substr(0, size)), 1 << 20);
      EXPECT_FALSE(texture) << name << " cut to " << share;
      EXPECT_FALSE(texture.reason().empty());
    }
  }
}

std::string little_endian(std::uint32_t value, std::size_t count) {
  std::string out;
  for (std::size_t i = 0; i < count; ++i) out += static_cast<char>(value >> (8 * i) & 255u);
  return out;
}

/// Overwrites the value of a tag in a TIFF of Intel's byte order that has one directory.
void set_tag(std::string& tiff, std::uint32_t tag, std::uint32_t value) {
  const auto number = [&](std::size_t at, std::size_t count) {
    std::uint32_t read = 0;
    for (std::size_t i = count; i-- > 0;) read = read << 8 | static_cast<unsigned char>(tiff[at + i]);
    return read;
  };
  const std::size_t directory = number(4, 4);
  for (std::size_t i = 0; i < number(directory, 2); ++i) {
    const std::size_t entry = directory + 2 + 12 * i;
    if (number(entry, 2) == tag) tiff.replace(entry + 8, 4, little_endian(value, 4));
  }
}

/// 32 x 32 pixels in tiles.
std::string tiled_tiff(const ModelOnDisk& disk) {
  const fs::path file = disk.folder() / "tiles.tif";
  auto output = OIIO::ImageOutput::create(file.string());
  OIIO::ImageSpec spec(32, 32, 1, OIIO::TypeDesc::UINT8);
  spec.tile_width = spec.tile_height = 16;
  spec.attribute("compression", "zip");
  const std::vector<std::uint8_t> gray(32 * 32, 128);
  EXPECT_TRUE(output && output->open(file.string(), spec) &&
              output->write_image(OIIO::TypeDesc::UINT8, gray.data()) && output->close());
  return bytes_of(file);
}

TEST(ImageFile, RefusesHugeTilesBeforeItUnpacksOne) {
  const ModelOnDisk disk;
  std::string tiff = tiled_tiff(disk);
  EXPECT_TRUE(load_image_file(disk.folder() / "tiles.tif", 1 << 20));
  set_tag(tiff, 322, 65520);
  set_tag(tiff, 323, 65520);
  const auto texture = load_image_file(disk.write("huge.tif", tiff), 1 << 20);
  EXPECT_NE(texture.reason().find("its tiles of 65520 x 65520 pixels take 4094 MB each"), std::string::npos)
      << texture.reason();
}

TEST(ImageFile, RefusesCompressionsThatUnpackToWhatTheirStreamSays) {
  const ModelOnDisk disk;
  std::string tiff = tiled_tiff(disk);
  set_tag(tiff, 259, 50000);  // Zstandard
  const auto texture = load_image_file(disk.write("zstd.tif", tiff), 1 << 20);
  EXPECT_NE(texture.reason().find("its compression (TIFF's number 50000) is not read"), std::string::npos)
      << texture.reason();
}

TEST(ImageFile, BelievesNoHeaderThatUnpacksAtOpening) {
  const ModelOnDisk disk;
  const auto refusal = [&](const std::string& name, const std::string& bytes) {
    return load_image_file(disk.write(name, bytes), 1 << 20).reason();
  };
  // Run-length encoded, 40,000 pixels each way: OpenImageIO unpacks it when it opens it.
  std::string bmp = "BM" + little_endian(2000, 4) + little_endian(0, 4) + little_endian(54 + 1024, 4) +
                    little_endian(40, 4) + little_endian(40000, 4) + little_endian(40000, 4) +
                    little_endian(1, 2) + little_endian(8, 2) + little_endian(1, 4);
  bmp.resize(2000, '\0');
  EXPECT_NE(refusal("rle.bmp", bmp).find("it has 40000 x 40000 pixels"), std::string::npos)
      << refusal("rle.bmp", bmp);
  const std::string upside_down = bmp.substr(0, 22) + little_endian(static_cast<std::uint32_t>(-40000), 4);
  EXPECT_NE(refusal("rle.bmp", upside_down + bmp.substr(26)).find("it has 40000 x 40000 pixels"),
            std::string::npos);
  // A canvas of 2 x 2 with a frame of 65,535 x 65,535.
  const std::string gif = "GIF89a" + little_endian(2, 2) + little_endian(2, 2) + std::string("\x80\0\0", 3) +
                          std::string(6, '\0') + std::string("\x21\xfe\2hi\0", 6) + "," +
                          little_endian(0, 4) + little_endian(65535, 2) + little_endian(65535, 2) +
                          std::string("\0\2\0;", 4);
  EXPECT_NE(refusal("frame.gif", gif).find("it has 65535 x 65535 pixels"), std::string::npos);
  std::string tga = std::string("\0\0\12\0\0\0\0\0\0\0\0\0", 12) + little_endian(65535, 2) +
                    little_endian(65535, 2) + "\x18\x20";
  EXPECT_NE(refusal("rle.tga", tga).find("it has 65535 x 65535 pixels"), std::string::npos);
}

TEST(ImageFile, RefusesAProgressiveJpegWithScansBeyondNumber) {
  const ModelOnDisk disk;
  std::string jpeg = bytes_of(save(disk, "a.jpg", 3, 2, 3, kPixels));
  const std::size_t scan = jpeg.find("\xff\xda");
  std::string scans;
  for (int i = 0; i < 1000; ++i) scans += std::string("\xff\xda\0\x08\1\1\0\0\x3f\0", 10);
  EXPECT_TRUE(load_image_file(disk.folder() / "a.jpg", 6));
  const auto texture = load_image_file(disk.write("scans.jpg", jpeg.insert(scan, scans)), 6);
  EXPECT_NE(texture.reason().find("in 1001 scans"), std::string::npos) << texture.reason();
}

TEST(ImageFile, WritesPngThatItReadsBack) {
  const ModelOnDisk disk;
  const fs::path file = disk.folder() / "out.png";
  save_png({3, 2, 3, kPixels}, file);
  const auto texture = load_image_file(file, 1000);
  ASSERT_TRUE(texture) << texture.reason();
  EXPECT_NEAR(texture->luminance[3], .2126, 1e-4) << "row 0 of a picture is its top";
  save_png({2, 1, 1, {0, 255}}, file);
  EXPECT_EQ(load_image_file(file, 1000)->channels, 1);
  EXPECT_THROW(save_png({2, 2, 1, {0, 255}}, file), InputError);
  EXPECT_THROW(save_png({1, 1, 1, {0}}, disk.folder() / "no/folder/out.png"), InputError);
}

}  // namespace
}  // namespace hilbrush
