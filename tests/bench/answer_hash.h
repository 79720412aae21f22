#pragma once
#include <cstdint>
#include <cstring>

namespace hilbrush {

/// FNV-1a over the bits of all figures that a benchmark prints: the same figures, the same hash.
class AnswerHash {
 public:
  void take(double value) {
    std::uint64_t bits = 0;
    static_assert(sizeof bits == sizeof value);
    std::memcpy(&bits, &value, sizeof bits);
    for (unsigned i = 0; i < 8; ++i) hash_ = (hash_ ^ (bits >> (8 * i) & 0xff)) * 0x100000001b3u;
  }
  unsigned long long value() const { return hash_; }

 private:
  std::uint64_t hash_ = 0xcbf29ce484222325u;
};

}  // namespace hilbrush
