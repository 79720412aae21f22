#include "drivers/link/message_ring.h"

#include <algorithm>

#include "drivers/number_text.h"

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
      text += byte >= 0x20 && byte < 0x7F ? std::string(1, entry.bytes[k]) : "\\x" + hex_text(byte, 2);
    }
    const double ago_s = std::chrono::duration<double>(now - entry.time).count();
    text += entry.is_cut ? "...\" " : "\" ";
    text += ago_s < 1 ? fixed_text(ago_s * 1e3, 1) + " ms ago" : fixed_text(ago_s, 1) + " s ago";
  }
  return text.empty() ? text : text + ")";
}

}  // namespace hilbrush
