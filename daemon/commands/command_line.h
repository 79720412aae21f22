#pragma once
#include <string>
#include <vector>

#include "daemon/commands/terminal.h"

/// The operator's command `hilbrush`, without its main(): parses the arguments, runs one command, reports
/// errors as sentences.
///   settings_flags                               flags to settings of a job
///   pipeline_commands, quality_command, pipeline_run   work on a mesh, in a child process
///   job_commands, cell_commands, watch, rpc_client     requests to the daemon
///   check_command, commissioning_commands        files and devices, without a daemon
///   text_output, progress_display                the output for people
namespace hilbrush {

/// `arguments`: without the name of the program. Returns an exit code, see exit_code.h. Never throws.
int run_hilbrush(const std::vector<std::string>& arguments, Terminal& terminal);

}  // namespace hilbrush
