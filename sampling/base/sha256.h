#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

/// SHA-256 (FIPS 180-4), for provenance. Own code because cell_model links nothing but Eigen.
namespace hilbrush {

class Sha256 {
 public:
  Sha256();
  void update(std::span<const std::uint8_t> bytes);
  void update(std::string_view text);
  /// With the bytes of a file. @return false if it cannot be opened.
  [[nodiscard]] bool update_from_file(const std::filesystem::path& file);
  /// Hex digest; the object must not be used afterwards.
  std::string hex_digest();

 private:
  void compress(const std::uint8_t* block);
  std::array<std::uint32_t, 8> state_;
  std::array<std::uint8_t, 64> buffer_{};
  std::uint64_t byte_count_ = 0;
};

std::string sha256_hex(std::string_view text);

}  // namespace hilbrush
