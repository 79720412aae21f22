#pragma once
#include <functional>
#include <string>

#include "daemon/commands/terminal.h"

namespace CLI {
class App;
}

/// What all commands of `hilbrush` share. A command declares its flags on a CLI::App; if the user gives that
/// command, parsing sets `action` to its work.
namespace hilbrush {

struct CommandContext {
  Terminal& terminal;
  std::string socket_path;
  bool is_json = false;
  std::function<int()> action;  ///< returns an exit code; run_hilbrush() reports what it throws
};

/// A subcommand with --json, --help and --version.
CLI::App* add_command(CLI::App& app, CommandContext& context, const std::string& name,
                      const std::string& description);
/// The same with --socket.
CLI::App* add_daemon_command(CLI::App& app, CommandContext& context, const std::string& name,
                             const std::string& description);

/// dry-run, plan, develop, calibrate
void add_pipeline_commands(CLI::App& app, CommandContext& context);
/// submit, watch, list, get, start, pause, resume, move, cancel
void add_job_commands(CLI::App& app, CommandContext& context);
/// status, stop, clear, arm, home, info
void add_cell_commands(CLI::App& app, CommandContext& context);
/// check-config
void add_check_command(CLI::App& app, CommandContext& context);
/// check-cell, jog
void add_commissioning_commands(CLI::App& app, CommandContext& context);
/// quality
void add_quality_command(CLI::App& app, CommandContext& context);

}  // namespace hilbrush
