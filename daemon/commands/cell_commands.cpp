#include <CLI/CLI.hpp>
#include <array>
#include <chrono>
#include <nlohmann/json.hpp>
#include <ostream>

#include "daemon/commands/command_context.h"
#include "daemon/commands/exit_code.h"
#include "daemon/commands/rpc_client.h"
#include "daemon/commands/text_output.h"

namespace hilbrush {
namespace {

using Json = nlohmann::ordered_json;

/// Clearing, arming and homing are answered when they are done: long enough for a laser's start delay and a
/// slow axis.
constexpr auto kMotionTimeout = std::chrono::seconds(120);
constexpr auto kAnswerTimeout = std::chrono::seconds(10);

struct CellCommand {
  const char *name, *method, *description;
  std::chrono::seconds timeout;
};

int call_daemon(const CommandContext& context, const CellCommand& command) {
  RpcClient client(context.socket_path);
  const Json result = client.call(command.method, Json(), command.timeout);
  const std::string method = command.method;
  if (context.is_json)
    context.terminal.out << result.dump() << std::endl;
  else if (method == "system.info")
    context.terminal.out << format_fields(member(result, "system").is_object() ? member(result, "system")
                                                                               : result)
                         << std::flush;
  else if (method == "cell.status")
    context.terminal.out << format_cell(member(result, "cell")) << std::flush;
  else
    context.terminal.out << format_cell_line(member(result, "cell")) << std::endl;
  return kExitOk;
}

}  // namespace

void add_cell_commands(CLI::App& app, CommandContext& context) {
  static constexpr std::array kCommands{
      CellCommand{"status", "cell.status", "show the state of the cell and its devices", kAnswerTimeout},
      CellCommand{"stop", "cell.stop", "turn the laser off and stop all motion at once; stays so until clear",
                  kAnswerTimeout},
      CellCommand{"clear", "cell.clear", "clear a stop or a fault whose cause is gone", kMotionTimeout},
      CellCommand{"arm", "cell.arm", "make the cell ready to paint: enable the devices, arm the laser",
                  kMotionTimeout},
      CellCommand{"home", "cell.home", "move all axes to their home positions, laser off", kMotionTimeout},
      CellCommand{"info", "system.info", "show the daemon's version, cell, folders and limits",
                  kAnswerTimeout},
  };
  for (const CellCommand& entry : kCommands) {
    CLI::App* command = add_daemon_command(app, context, entry.name, entry.description);
    command->callback(
        [&context, &entry] { context.action = [&context, &entry] { return call_daemon(context, entry); }; });
  }
}

}  // namespace hilbrush
