#pragma once
#include <string>
#include <vector>

#include "daemon/commands/terminal.h"

/// The operator's command `hilbrush`, without its main(): parses, runs one command, reports errors as sentences.
///   settings_flags (flags to settings), pipeline_commands + pipeline_run (what needs a mesh, in a child process),
///   job_commands + cell_commands + rpc_client (what the daemon does), text_output + progress_display (what people
///   read).
namespace hilbrush {

/// `arguments` without the program's name. Returns an exit code, see exit_code.h. Never throws.
int run_hilbrush(const std::vector<std::string>& arguments, Terminal& terminal);

}  // namespace hilbrush
