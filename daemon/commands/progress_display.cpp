#include "daemon/commands/progress_display.h"

#include <algorithm>
#include <cmath>
#include <ostream>

namespace hilbrush {

void ProgressDisplay::show(const std::string& phase, double fraction, const std::string& text, bool lines_every_tenth) {
  if (is_quiet_) return;
  fraction = std::isfinite(fraction) ? std::clamp(fraction, 0., 1.) : 0;
  if (!terminal_.out_is_terminal) {
    const int tenth = lines_every_tenth ? static_cast<int>(std::floor(fraction * 10 + 1e-9)) : 0;
    if (phase == phase_ && tenth <= tenth_) return;
    phase_ = phase;
    tenth_ = tenth;
    terminal_.out << printable(text) << std::endl;
    return;
  }
  constexpr int kBarWidth = 24;
  const int filled = static_cast<int>(std::floor(fraction * kBarWidth));
  std::string bar = "[" + std::string(static_cast<std::size_t>(filled), '#') +
                    std::string(static_cast<std::size_t>(kBarWidth - filled), '.') + "] " + printable(text);
  // A bar that wraps could not be removed.
  bar.resize(std::min(bar.size(), static_cast<std::size_t>(std::max(20, terminal_.width - 1))));
  if (bar == drawn_) return;
  clear_bar();
  drawn_ = bar;
  terminal_.out << bar << std::flush;
}

void ProgressDisplay::print_above(const std::string& line) {
  const std::string bar = drawn_;
  clear_bar();
  terminal_.err << printable(line) << std::endl;
  drawn_ = bar;
  terminal_.out << bar << std::flush;
}

void ProgressDisplay::finish() {
  clear_bar();
  if (terminal_.out_is_terminal) terminal_.out << std::flush;
}

void ProgressDisplay::clear_bar() {
  if (drawn_.empty()) return;
  terminal_.out << "\r\033[K" << std::flush;  // start of the line, erase to its end
  drawn_.clear();
}

}  // namespace hilbrush
