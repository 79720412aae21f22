#pragma once
#include <string>

#include "daemon/commands/command_context.h"

namespace hilbrush {

/// Follows job `id` with a progress bar on a terminal, plain lines in a pipe (each change of state, each tenth), each
/// update as JSON with --json, until it reaches `until` or ends. Returns kExitOk if it got there, kExitJobFailed if it
/// failed or was cancelled.
/// @throws ConnectionError, RpcRefusal, Interrupted
int watch_job(CommandContext& context, const std::string& id, const std::string& until);

}  // namespace hilbrush
