#pragma once
#include <string>

#include "daemon/commands/terminal.h"

/// Progress on standard output: a bar that is redrawn in place on a terminal, plain lines in a pipe.
namespace hilbrush {

class ProgressDisplay {
 public:
  /// `is_quiet`: shows nothing (--json).
  ProgressDisplay(Terminal& terminal, bool is_quiet) : terminal_(terminal), is_quiet_(is_quiet) {}
  ~ProgressDisplay() { finish(); }
  ProgressDisplay(const ProgressDisplay&) = delete;
  ProgressDisplay& operator=(const ProgressDisplay&) = delete;

  /// If the text does not fit beside the bar, the bar is drawn shorter, then the last of the text's parts,
  /// which commas separate, are left out. In a pipe a line is printed when `phase` changes and, if
  /// `lines_every_tenth`, at every tenth of it.
  void show(const std::string& phase, double fraction, const std::string& text,
            bool lines_every_tenth = false);
  /// A line of its own, above the bar.
  void print_above(const std::string& line);
  /// Removes the bar.
  void finish();

 private:
  void clear_bar();

  Terminal& terminal_;
  bool is_quiet_;
  std::string drawn_;      ///< the bar as it is on the screen
  int drawn_columns_ = 0;  ///< of the terminal when it was drawn
  std::string phase_;      ///< of the last line printed in a pipe
  int tenth_ = -1;
};

}  // namespace hilbrush
