#pragma once
#include <functional>
#include <string>

#include "daemon/commands/terminal.h"

namespace CLI {
class App;
}

/// What all commands of `hilbrush` share. A command declares its flags on a CLI::App and, when it was chosen, leaves
/// what to do in `action`.
namespace hilbrush {

struct CommandContext {
  Terminal& terminal;
  std::string socket_path;
  bool is_json = false;
  std::function<int()> action;  ///< returns an exit code; throws what run_hilbrush() reports
};

/// A subcommand with --json, --help and --version.
CLI::App* add_command(CLI::App& app, CommandContext& context, const std::string& name, const std::string& description);
/// The same with --socket.
CLI::App* add_daemon_command(CLI::App& app, CommandContext& context, const std::string& name,
                             const std::string& description);

void add_pipeline_commands(CLI::App& app, CommandContext& context);  ///< dry-run, plan, develop, calibrate
void add_job_commands(CLI::App& app,
                      CommandContext& context);  ///< submit, watch, list, get, start, pause, resume, move, cancel
void add_cell_commands(CLI::App& app, CommandContext& context);           ///< status, stop, clear, arm, home, info
void add_check_command(CLI::App& app, CommandContext& context);           ///< check-config
void add_commissioning_commands(CLI::App& app, CommandContext& context);  ///< check-cell, jog
void add_quality_command(CLI::App& app, CommandContext& context);         ///< quality

}  // namespace hilbrush
