#include "drivers/link/line_codec.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

namespace hilbrush::line_codec {

std::string_view trimmed(std::string_view text) {
  const auto is_space = [](char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; };
  while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
  return text;
}

bool equals_ignoring_case(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](char x, char y) {
    return std::tolower(static_cast<unsigned char>(x)) == std::tolower(static_cast<unsigned char>(y));
  });
}

std::optional<double> decode_number(std::string_view line) {
  line = trimmed(line);
  if (!line.empty() && line.front() == '+') line.remove_prefix(1);
  double value = 0;
  const auto [rest, error] = std::from_chars(line.data(), line.data() + line.size(), value);
  if (error != std::errc() || rest != line.data() + line.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<long> decode_integer(std::string_view line) {
  line = trimmed(line);
  long value = 0;
  const auto [rest, error] = std::from_chars(line.data(), line.data() + line.size(), value);
  if (error != std::errc() || rest != line.data() + line.size()) return std::nullopt;
  return value;
}

}  // namespace hilbrush::line_codec
