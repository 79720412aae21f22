#pragma once
#include <CLI/CLI.hpp>
#include <string>

namespace hilbrush {

/// For flags of unsigned type: without it CLI11 takes -4 for 18446744073709551612.
inline CLI::Validator not_negative() {
  return CLI::Validator(
      [](std::string& text) {
        return text.starts_with("-") ? "expected a whole number of at least 0, found " + text : std::string();
      },
      "");
}

}  // namespace hilbrush
