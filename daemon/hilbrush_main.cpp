#include <sys/ioctl.h>
#include <unistd.h>

#include <iostream>
#include <string>
#include <vector>

#include "daemon/commands/command_line.h"

namespace {

int terminal_width() {
  winsize size{};
  return ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

}  // namespace

/// The operator's command: see daemon/commands/command_line.h.
int main(int argc, char** argv) {
  hilbrush::Terminal terminal{
      std::cout,        std::cerr,     std::cin, isatty(STDOUT_FILENO) == 1, isatty(STDIN_FILENO) == 1,
      terminal_width(), terminal_width};
  return hilbrush::run_hilbrush(std::vector<std::string>(argv + (argc > 0 ? 1 : 0), argv + argc), terminal);
}
