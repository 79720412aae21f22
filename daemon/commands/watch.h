#pragma once
#include <string>

#include "daemon/commands/command_context.h"

namespace hilbrush {

/// Follows job `id` until it reaches the state `until` ("part": until the part that is being painted is done)
/// or ends: with a progress bar on a terminal, lines in a pipe (each change of state, each tenth), or each
/// update as JSON with --json. Returns kExitOk, or kExitJobFailed if the job failed or was cancelled.
/// @throws ConnectionError, RpcRefusal, Interrupted
int watch_job(CommandContext& context, const std::string& id, const std::string& until);

}  // namespace hilbrush
