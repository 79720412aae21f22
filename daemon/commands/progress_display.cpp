#include "daemon/commands/progress_display.h"

#include <algorithm>
#include <cmath>
#include <ostream>

namespace hilbrush {
namespace {

/// A bar that wraps could not be removed: it takes less than `columns`.
std::string bar_text(double fraction, std::string text, int columns) {
  constexpr int kBarMax = 24;
  constexpr int kBarMin = 8;
  constexpr int kFrame = 3;  // "[] "
  const int room = std::max(20, columns - 1) - kFrame;
  const int width = std::clamp(room - static_cast<int>(text.size()), kBarMin, kBarMax);
  const auto text_room = static_cast<std::size_t>(room - width);
  if (text.size() > text_room) {
    const std::size_t comma = text.rfind(", ", text_room);
    text.resize(comma == std::string::npos || comma == 0 ? text_room : comma);
  }
  const int filled = static_cast<int>(std::floor(fraction * width));
  return "[" + std::string(static_cast<std::size_t>(filled), '#') +
         std::string(static_cast<std::size_t>(width - filled), '.') + "] " + text;
}

}  // namespace

void ProgressDisplay::show(const std::string& phase, double fraction, const std::string& text,
                           bool lines_every_tenth) {
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
  const int columns = terminal_.columns();
  const std::string bar = bar_text(fraction, printable(text), columns);
  if (bar == drawn_ && columns == drawn_columns_) return;
  clear_bar();
  drawn_ = bar;
  drawn_columns_ = columns;
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
  // A window that has become narrower has wrapped the bar into several rows: up to the first, erase to the
  // screen's end.
  const auto columns = static_cast<std::size_t>(std::max(1, terminal_.columns()));
  if (const std::size_t rows = (drawn_.size() - 1) / columns; rows > 0)
    terminal_.out << "\033[" << rows << "A\r\033[J" << std::flush;
  else
    terminal_.out << "\r\033[K" << std::flush;  // start of the line, erase to its end
  drawn_.clear();
}

}  // namespace hilbrush
