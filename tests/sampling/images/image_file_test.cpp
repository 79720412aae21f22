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
const std::vector<std::uint8_t> kPixels{255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255, 0, 0, 0, 128, 128, 128};

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
  texture = load_image_file(save<float>(disk, "linear.tif", 1, 1, 3, {.5f, .5f, .5f}, OIIO::TypeDesc::FLOAT), 1000);
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
  for (std::size_t i = 0; i < noise.size(); ++i) noise[i] = static_cast<std::uint8_t>((i * 2654435761u) >> 13);
  for (const char* name : {"a.png", "a.jpg", "a.gif", "a.tga", "a.bmp", "a.tif"}) {
    const std::string bytes = bytes_of(save(disk, name, 64, 64, 3, noise));
    for (const double share : {.02, .3, .6, .9}) {
      const auto size = static_cast<std::size_t>(share * static_cast<double>(bytes.size()));
      const auto texture = load_image_file(disk.write(std::string("cut_") + name, bytes.substr(0, size)), 1 << 20);
      EXPECT_FALSE(texture) << name << " cut to " << share;
      EXPECT_FALSE(texture.reason().empty());
    }
  }
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
