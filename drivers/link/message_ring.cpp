#include "drivers/link/message_ring.h"

#include <algorithm>
#include <cstdio>

namespace hilbrush {

void MessageRing::add(bool is_sent, std::string_view message) {
  const std::lock_guard lock(mutex_);
  Message& entry = messages_[count_++ % kMessages];
  entry.is_sent = is_sent;
  entry.is_cut = message.size() > kTextMax;
  entry.time = Steady::now();
  entry.size = std::min(message.size(), kTextMax);
  std::copy_n(message.begin(), entry.size, entry.bytes.begin());
}

std::string MessageRing::text(std::size_t count) const {
  const std::lock_guard lock(mutex_);
  const auto now = Steady::now();
  const std::size_t shown = std::min({count, count_, kMessages});
  std::string text;
  for (std::size_t i = count_ - shown; i < count_; ++i) {
    const Message& entry = messages_[i % kMessages];
    text += text.empty() ? " (last messages: " : "; ";
    text += entry.is_sent ? "sent \"" : "received \"";
    for (std::size_t k = 0; k < entry.size; ++k) {
      const auto byte = static_cast<unsigned char>(entry.bytes[k]);
      char escaped[8];
      std::snprintf(escaped, sizeof escaped, byte >= 0x20 && byte < 0x7F ? "%c" : "\\x%02X", byte);
      text += escaped;
    }
    char age[40];
    const double ago_s = std::chrono::duration<double>(now - entry.time).count();
    std::snprintf(age, sizeof age, ago_s < 1 ? "%s\" %.1f ms ago" : "%s\" %.1f s ago", entry.is_cut ? "..." : "",
                  ago_s < 1 ? ago_s * 1e3 : ago_s);
    text += age;
  }
  return text.empty() ? text : text + ")";
}

}  // namespace hilbrush
