#include "sampling/base/sha256.h"

#include <gtest/gtest.h>

#include <random>

namespace hilbrush {
namespace {

TEST(Sha256, PublishedVectors) {
  // FIPS 180-4 examples; the last is the million letters of the same publication.
  EXPECT_EQ(sha256_hex(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256_hex("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256_hex("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(sha256_hex(std::string(1'000'000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, PiecesMakeTheWhole) {
  std::mt19937 random(7);
  for (std::size_t length = 0; length < 300; ++length) {
    std::string text(length, '\0');
    for (char& c : text) c = static_cast<char>(random());
    Sha256 hash;
    for (std::size_t at = 0; at < length;) {
      const std::size_t piece = std::min<std::size_t>(1 + random() % 70, length - at);
      hash.update(std::string_view(text).substr(at, piece));
      at += piece;
    }
    EXPECT_EQ(hash.hex_digest(), sha256_hex(text)) << "length " << length;
  }
}

}  // namespace
}  // namespace hilbrush
