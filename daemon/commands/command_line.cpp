#include "daemon/commands/command_line.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <ostream>

#include "config/rpc_errors.h"
#include "daemon/commands/command_context.h"
#include "daemon/commands/exit_code.h"
#include "daemon/commands/interrupt.h"
#include "daemon/commands/pipeline_run.h"
#include "daemon/commands/rpc_client.h"
#include "daemon/execution/cell_devices.h"
#include "drivers/driver_error.h"
#include "sampling/base/input_error.h"

namespace hilbrush {
namespace {

constexpr const char* kFooter =
    "Exit codes: 0 done; 1 internal failure; 2 wrong usage; 3 bad input (model, settings, cell, program, job);\n"
    "4 no daemon answers or the connection was lost; 5 refused in this state; 6 the job failed or was cancelled;\n"
    "130 interrupted.";

std::string default_socket() {
  const char* path = std::getenv("HILBRUSH_SOCKET");
  return path != nullptr && *path != '\0' ? path : "/run/hilbrush/hilbrush.sock";
}

int exit_code_of(int rpc_error) {
  switch (rpc_error) {
    case kRpcBadParams:
    case kRpcBadInput:
    case kRpcNoSuchJob:
      return kExitBadInput;
    case kRpcWrongState:
    case kRpcDeviceFault:
    case kRpcNotPermitted:
      return kExitRefused;
    default:
      return kExitInternal;
  }
}

/// Prints the sentence on standard error; with --json also as an object on standard output.
int report_failure(const CommandContext& context, int exit_code, const std::string& at, const std::string& sentence) {
  context.terminal.err << "hilbrush: " << printable(at.empty() ? sentence : at + ": " + sentence) << std::endl;
  if (context.is_json) {
    const nlohmann::ordered_json error{{"error", {{"code", exit_code}, {"message", sentence}, {"at", at}}}};
    context.terminal.out << error.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) << std::endl;
  }
  return exit_code;
}

/// Prints what a failed child wrote to its standard error, each line marked as a quotation.
void quote_child(const CommandContext& context, const std::string& child_stderr) {
  for (std::size_t start = 0; start < child_stderr.size();) {
    const std::size_t end = std::min(child_stderr.find('\n', start), child_stderr.size());
    if (end > start) context.terminal.err << "  | " << printable(child_stderr.substr(start, end - start)) << '\n';
    start = end + 1;
  }
}

int run_action(const CommandContext& context) {
  try {
    return context.action();
  } catch (const CellHeld& error) {
    return report_failure(context, kExitRefused, error.at(), error.sentence());
  } catch (const DriverError& error) {
    return report_failure(context, kExitRefused, {}, error.what());
  } catch (const InputError& error) {
    return report_failure(context, kExitBadInput, error.at(), error.sentence());
  } catch (const RpcRefusal& error) {
    return report_failure(context, exit_code_of(error.code()), error.at(), error.what());
  } catch (const ConnectionError& error) {
    return report_failure(context, kExitNoDaemon, {}, error.what());
  } catch (const PipelineFailure& error) {
    const int code = report_failure(context, error.exit_code(), error.at(), error.what());
    quote_child(context, error.child_stderr());
    return code;
  } catch (const Interrupted& interrupted) {
    return report_failure(context, kExitInterrupted, {}, interrupted.sentence);
  } catch (const std::exception& error) {
    return report_failure(context, kExitInternal, {}, error.what());
  }
}

}  // namespace

CLI::App* add_command(CLI::App& app, CommandContext& context, const std::string& name, const std::string& description) {
  CLI::App* command = app.add_subcommand(name, description);
  command->add_flag("--json", context.is_json, "print the exact result as JSON");
  command->set_version_flag("--version", "hilbrush " HILBRUSH_VERSION);
  command->footer(kFooter);
  return command;
}

CLI::App* add_daemon_command(CLI::App& app, CommandContext& context, const std::string& name,
                             const std::string& description) {
  CLI::App* command = add_command(app, context, name, description);
  command->add_option(
      "--socket", context.socket_path,
      "the daemon's socket, or tcp://HOST:PORT with a token in $HILBRUSH_TOKEN (default $HILBRUSH_SOCKET, "
      "else /run/hilbrush/hilbrush.sock)");
  return command;
}

int run_hilbrush(const std::vector<std::string>& arguments, Terminal& terminal) {
  CommandContext context{terminal, default_socket(), false, {}};
  CLI::App app("Paints pictures on three-dimensional objects with light.", "hilbrush");
  app.set_version_flag("--version", "hilbrush " HILBRUSH_VERSION);
  app.require_subcommand(1);
  app.footer(std::string("`hilbrush COMMAND --help` explains one command.\n") + kFooter);
  try {
    add_pipeline_commands(app, context);
    add_quality_command(app, context);
    add_job_commands(app, context);
    add_cell_commands(app, context);
    add_check_command(app, context);
    add_commissioning_commands(app, context);
    app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));  // CLI11 takes them from the back
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) {  // help or version was asked for
      app.exit(error, terminal.out, terminal.err);
      return kExitOk;
    }
    terminal.err << "hilbrush: " << printable(error.what()) << "\nTry hilbrush --help.\n";
    return kExitUsage;
  } catch (const std::exception& error) {
    return report_failure(context, kExitInternal, {}, error.what());
  }
  return run_action(context);
}

}  // namespace hilbrush
