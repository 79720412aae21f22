#pragma once
#include <string>

/// Shell commands for tests.
namespace hilbrush::testing_support {

struct CommandResult {
  int exit_code = 0;   ///< 128 + the signal's number if it was killed by one
  std::string output;  ///< both streams
};
/// Runs a shell command to its end.
CommandResult run_command(const std::string& command);

/// In single quotes, for a shell.
std::string quoted(const std::string& text);

/// The full path of a program, or "".
std::string find_program(const std::string& name);

}  // namespace hilbrush::testing_support
