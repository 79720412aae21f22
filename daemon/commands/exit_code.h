#pragma once

/// The exit codes of `hilbrush`, for scripts. hilbrush-pipeline uses 0 to 3 with the same meaning.
namespace hilbrush {

enum ExitCode : int {
  kExitOk = 0,
  kExitInternal = 1,  ///< a fault of the program or of the machine
  kExitUsage = 2,     ///< unknown command or flag
  kExitBadInput = 3,  ///< model, settings, cell, program or job number
  kExitNoDaemon = 4,  ///< no daemon answers, or the connection was lost
  kExitRefused = 5,   ///< the daemon or the operator refused: wrong state, device fault, not permitted
  kExitJobFailed =
      6,  ///< the job that was watched failed or was cancelled, or none of its dots can be exposed
  kExitInterrupted = 130  ///< Ctrl-C, as shells report it
};

}  // namespace hilbrush
