#pragma once
#include <cstdint>

/// Which texel a grid line of an unbounded picture finds.
namespace hilbrush {

struct TexelAddressing {
  bool repeat_x = true, repeat_y = true;  ///< else the border texels go on for ever

  bool operator==(const TexelAddressing&) const = default;
};

/// std::floor, which without SSE 4.1 is a call.
inline std::int64_t floor_index(double x) {
  const auto i = static_cast<std::int64_t>(x);
  return i - (static_cast<double>(i) > x ? 1 : 0);
}

inline std::int64_t texel_index(std::int64_t i, int size, bool repeats) {
  if (i >= 0 && i < size) return i;
  if (!repeats) return i < 0 ? 0 : size - 1;
  const std::int64_t r = i % size;
  return r < 0 ? r + size : r;
}

}  // namespace hilbrush
