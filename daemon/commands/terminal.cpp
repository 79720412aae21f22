#include "daemon/commands/terminal.h"

#include <algorithm>

namespace hilbrush {

std::string printable(const std::string& text) {
  std::string clean = text;
  // Bytes from 0x80 on are parts of UTF-8 characters; the control characters among those are C2 80 to C2 9F.
  for (std::size_t i = 0; i < clean.size(); ++i) {
    const auto byte = static_cast<unsigned char>(clean[i]);
    const auto next = static_cast<unsigned char>(i + 1 < clean.size() ? clean[i + 1] : 0);
    if (byte < 0x20 || byte == 0x7f) clean[i] = ' ';
    if (byte == 0xc2 && next >= 0x80 && next <= 0x9f) clean[i] = clean[i + 1] = ' ';
  }
  return clean;
}

}  // namespace hilbrush
