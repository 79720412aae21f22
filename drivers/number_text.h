#pragma once
#include <cstdint>
#include <string>

/// Numbers as text, for messages and commands. Always with a decimal point, whatever the locale.
namespace hilbrush {

/// With `digits` significant ones and no trailing zeros: 12.3, 1e-05.
std::string number_text(double value, int digits);
/// With this many decimals: 12.300.
std::string fixed_text(double value, int decimals);
/// The shortest text that reads back as the same number.
std::string exact_text(double value);
/// Upper case, at least `digits` of them: 00A5.
std::string hex_text(std::uint32_t value, std::size_t digits);

}  // namespace hilbrush
