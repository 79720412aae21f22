#pragma once
#include <optional>
#include <string_view>

/// What the lasers' line protocols have in common. Pure functions.
namespace hilbrush::line_codec {

std::string_view trimmed(std::string_view text);
bool equals_ignoring_case(std::string_view a, std::string_view b);
/// A whole line that is one decimal number, finite.
std::optional<double> decode_number(std::string_view line);
std::optional<long> decode_integer(std::string_view line);

}  // namespace hilbrush::line_codec
