#pragma once
#include <string>
#include <string_view>

/// Text for files and messages; the locale has no part in it.
namespace hilbrush {

/// What separates words: the blanks of C's isspace.
inline constexpr std::string_view kBlanks = " \t\r\n\v\f";

/// Without the blanks around it.
std::string_view trimmed(std::string_view text);

/// ASCII letters only.
std::string lower_case(std::string_view text);

/// The shortest text of `value` rounded to `digits` significant digits, as printf's %g writes it: "0.25",
/// "1e-05", "inf".
std::string number(double value, int digits = 6);

/// An amount for a message: at least two significant digits, and every digit before the point: "0.25", "1.5",
/// "1234".
std::string amount(double value);

}  // namespace hilbrush
