#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <ostream>

#include "daemon/commands/command_context.h"
#include "daemon/commands/exit_code.h"
#include "daemon/commands/rpc_client.h"
#include "daemon/commands/text_output.h"

namespace hilbrush {
namespace {

using Json = nlohmann::ordered_json;

int ask_daemon(const CommandContext& context, const std::string& method) {
  RpcClient client(context.socket_path);
  const Json result = client.call(method, Json());
  if (context.is_json)
    context.terminal.out << result.dump() << std::endl;
  else if (const Json& cell = member(result, "cell"); cell.is_object() && method.starts_with("cell."))
    context.terminal.out << format_cell(cell) << std::flush;
  else
    context.terminal.out << format_fields(result) << std::flush;
  return kExitOk;
}

}  // namespace

void add_cell_commands(CLI::App& app, CommandContext& context) {
  struct Command {
    const char *name, *method, *description;
  };
  constexpr Command kCommands[] = {
      {"status", "cell.status", "say what the cell is doing"},
      {"stop", "cell.stop", "turn the laser off and stop all motion, now; latches until clear"},
      {"clear", "cell.clear", "release a stop or a fault, once its cause is gone"},
      {"arm", "cell.arm", "make the cell ready to paint: devices enabled, laser armed"},
      {"home", "cell.home", "move all axes to their home positions"},
      {"info", "system.info", "say which daemon answers: version, cell, state folder"},
  };
  for (const Command& entry : kCommands) {
    CLI::App* command = add_daemon_command(app, context, entry.name, entry.description);
    command->callback([&context, method = std::string(entry.method)] {
      context.action = [&context, method] { return ask_daemon(context, method); };
    });
  }
}

}  // namespace hilbrush
