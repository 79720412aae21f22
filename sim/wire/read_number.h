#pragma once
#include <charconv>
#include <cmath>
#include <string>

namespace hilbrush {

/// Whether the whole of `text` is a finite number, which is then `value`.
inline bool read_number(const std::string& text, double& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && std::isfinite(value);
}

}  // namespace hilbrush
