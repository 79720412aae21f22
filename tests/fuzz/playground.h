#pragma once
#include <unistd.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <stdexcept>
#include <string>

#include "sampling/images/image_file.h"
#include "tests/support/temporary_folder.h"

namespace hilbrush {

/// A folder to read mutants in, with everything that they may name: the corpus, images and links that lead
/// out of it inside, and files outside that must not be read. Removed at the end.
class Playground {
 public:
  /// @throws std::filesystem::filesystem_error if it cannot be made
  Playground();

  const std::filesystem::path& folder() const { return folder_; }
  const std::filesystem::path& outer() const { return outer_.path(); }
  /// File name to bytes of the models in the corpus.
  const std::map<std::string, std::string>& models() const { return models_; }
  /// One small picture of each format that is read.
  const std::map<std::string, std::string>& images() const { return images_; }

  /// Writes `bytes` into the folder and returns the path.
  std::filesystem::path write(const std::string& name, const std::string& bytes) const;

 private:
  testing_support::TemporaryFolder outer_;
  const std::filesystem::path folder_ = outer_ / "model";
  std::map<std::string, std::string> models_;
  std::map<std::string, std::string> images_;
};

namespace playground {

inline void put(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream out(file, std::ios::binary);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

inline std::string little(std::uint32_t value, int count) {
  std::string out;
  for (int i = 0; i < count; ++i) out += static_cast<char>(value >> (8 * i) & 255u);
  return out;
}

/// A 4 x 2 picture in uncompressed TGA, BMP and TIFF: simple enough to be written by hand.
inline std::string pixels() {
  std::string out;
  for (int i = 0; i < 8; ++i) out += {static_cast<char>(30 * i), static_cast<char>(255 - 30 * i), '\x40'};
  return out;
}
inline std::string tga() {
  return std::string("\0\0\2\0\0\0\0\0\0\0\0\0", 12) + little(4, 2) + little(2, 2) + "\x18\x20" + pixels();
}
inline std::string bmp() {
  return "BM" + little(54 + 24, 4) + little(0, 4) + little(54, 4) + little(40, 4) + little(4, 4) +
         little(2, 4) + little(1, 2) + little(24, 2) + little(0, 4) + little(24, 4) + little(2835, 4) +
         little(2835, 4) + little(0, 4) + little(0, 4) + pixels();
}
inline std::string tiff() {
  std::string out = "II" + little(42, 2) + little(8, 4);
  const std::array<std::array<std::uint32_t, 3>, 9> tags{{{256, 4, 4},
                                                          {257, 4, 2},
                                                          {258, 3, 8},
                                                          {259, 3, 1},
                                                          {262, 3, 2},
                                                          {273, 4, 122},
                                                          {277, 3, 3},
                                                          {278, 4, 2},
                                                          {279, 4, 24}}};
  out += little(static_cast<std::uint32_t>(tags.size()), 2);
  for (const auto& [tag, type, value] : tags)
    out += little(tag, 2) + little(type, 2) + little(1, 4) + little(value, 4);
  return out + little(0, 4) + pixels();
}
/// Two colors, 2 x 2, one code a pixel.
inline std::string gif() {
  return std::string("GIF89a") + little(2, 2) + little(2, 2) + std::string("\x80\0\0", 3) +
         std::string("\0\0\0\xff\xff\xff", 6) + "," + little(0, 4) + little(2, 2) + little(2, 2) +
         std::string("\0\2\3\x44\x34\x05\0;", 8);
}

}  // namespace playground

/// The whole file. @throws std::runtime_error if it cannot be read.
inline std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw std::runtime_error("cannot read " + file.string());
  return {std::istreambuf_iterator<char>(in), {}};
}

inline Playground::Playground() {
  std::filesystem::create_directories(folder_);
  for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(HILBRUSH_SOURCE_DIR) /
                                                               "tests/fuzz/corpus/models")) {
    models_[entry.path().filename().string()] = bytes_of(entry.path());
    std::filesystem::copy_file(entry.path(), folder_ / entry.path().filename());
  }
  Picture picture{4, 3, 3, {}};
  for (int i = 0; i < 36; ++i) picture.pixels.push_back(static_cast<std::uint8_t>(7 * i));
  save_png(picture, folder_ / "gradient.png");
  images_ = {{"image.png", bytes_of(folder_ / "gradient.png")},
             {"image.tga", playground::tga()},
             {"image.bmp", playground::bmp()},
             {"image.tif", playground::tiff()},
             {"image.gif", playground::gif()}};

  const std::string secret = "#VRML V2.0 utf8\nShape { geometry Box { size 9 9 9 } }\n";
  playground::put(outer_ / "outside.wrl", secret);
  playground::put(outer_ / "outside.mtl", "newmtl paint\nKd 1 0 0\n");
  std::filesystem::copy_file(folder_ / "gradient.png", outer_ / "outside.png");
  std::filesystem::create_symlink(outer_ / "outside.wrl", folder_ / "leak.wrl");
  std::filesystem::create_symlink("../outside.png", folder_ / "leak.png");
  std::filesystem::create_directory_symlink(outer_.path(), folder_ / "up");
}

inline std::filesystem::path Playground::write(const std::string& name, const std::string& bytes) const {
  playground::put(folder_ / name, bytes);
  return folder_ / name;
}

}  // namespace hilbrush
