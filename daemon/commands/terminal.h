#pragma once
#include <iosfwd>
#include <string>

/// Where a command talks to: standard output, error and input, or a test's streams.
namespace hilbrush {

struct Terminal {
  std::ostream& out;
  std::ostream& err;
  std::istream& in;
  bool out_is_terminal = false;  ///< progress bars are drawn; else plain lines
  bool in_is_terminal = false;   ///< questions may be asked
  int width = 80;                ///< columns
};

/// The text without what could steer a terminal: control characters become spaces. For text that comes from files and
/// sockets.
std::string printable(const std::string& text);

}  // namespace hilbrush
