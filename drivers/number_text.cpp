#include "drivers/number_text.h"

#include <algorithm>
#include <array>
#include <charconv>

namespace hilbrush {
namespace {

/// Holds the largest double with all its digits before the point, and 20 decimals.
using Characters = std::array<char, 340>;

template <class... Format>
std::string converted(Format... format) {
  Characters characters;
  const auto [end, error] =
      std::to_chars(characters.data(), characters.data() + characters.size(), format...);
  return error == std::errc() ? std::string(characters.data(), end)
                              : std::string("a number too long to print");
}

}  // namespace

std::string number_text(double value, int digits) {
  return converted(value, std::chars_format::general, digits);
}

std::string fixed_text(double value, int decimals) {
  return converted(value, std::chars_format::fixed, decimals);
}

std::string exact_text(double value) {
  return converted(value);
}

std::string hex_text(std::uint32_t value, std::size_t digits) {
  std::string text = converted(value, 16);
  std::transform(text.begin(), text.end(), text.begin(),
                 [](char c) { return c >= 'a' ? static_cast<char>(c - 'a' + 'A') : c; });
  return text.size() < digits ? std::string(digits - text.size(), '0') + text : text;
}

}  // namespace hilbrush
