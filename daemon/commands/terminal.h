#pragma once
#include <functional>
#include <iosfwd>
#include <string>

/// Input and output of a command: the standard streams, or those of a test.
namespace hilbrush {

struct Terminal {
  std::ostream& out;
  std::ostream& err;
  std::istream& in;
  bool out_is_terminal = false;  ///< progress bars are drawn; else plain lines
  bool in_is_terminal = false;   ///< questions may be asked
  int width = 80;                ///< columns
  /// Columns now, for windows that are resized; without it `width`.
  std::function<int()> measure_width = {};

  int columns() const { return measure_width ? measure_width() : width; }
};

/// The text with control characters replaced by spaces, so that it cannot control the terminal. For text that
/// comes from files and sockets.
std::string printable(const std::string& text);

}  // namespace hilbrush
