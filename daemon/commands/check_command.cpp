#include <CLI/CLI.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <ostream>

#include "config/cell_file.h"
#include "config/job_settings.h"
#include "config/json_reader.h"
#include "daemon/commands/command_context.h"
#include "daemon/commands/exit_code.h"

namespace hilbrush {
namespace {

using Json = nlohmann::ordered_json;

struct CheckFlags {
  std::string cell_file;
  std::string cell = "default";
  std::string settings_file;
};

int check_settings(const CommandContext& context, const std::string& file) {
  const JobSettings settings = job_settings_from_json(read_text_file(file, 64u << 10), file);
  if (context.is_json)
    context.terminal.out
        << Json{{"file", file}, {"settings", Json::parse(job_settings_to_json(settings))}}.dump() << '\n';
  else
    context.terminal.out << printable(file) << ": settings of a job, valid\n";
  return kExitOk;
}

int check_cell(const CommandContext& context, const CheckFlags& flags) {
  std::error_code error;
  const bool is_file = std::filesystem::exists(flags.cell_file, error) &&
                       !std::filesystem::is_directory(flags.cell_file, error);
  const std::filesystem::path file =
      is_file ? flags.cell_file : find_cell(flags.cell_file.empty() ? flags.cell : flags.cell_file).string();
  const CellDescription cell = load_cell(file);
  const std::vector<std::string> warnings = cell_warnings(cell);
  if (context.is_json) {
    context.terminal.out << Json{{"file", file.string()},
                                 {"cell", cell.name},
                                 {"sha256", cell.sha256},
                                 {"warnings", warnings}}
                                .dump()
                         << '\n';
    return kExitOk;
  }
  for (const std::string& warning : warnings)
    context.terminal.err << "warning: " << printable(file.string() + ": " + warning) << '\n';
  context.terminal.out << printable(file.string()) << ": cell \"" << printable(cell.name) << "\", valid";
  if (!warnings.empty())
    context.terminal.out << ", " << warnings.size() << (warnings.size() == 1 ? " warning" : " warnings");
  context.terminal.out << '\n';
  return kExitOk;
}

}  // namespace

void add_check_command(CLI::App& app, CommandContext& context) {
  auto flags = std::make_shared<CheckFlags>();
  CLI::App* command = add_command(app, context, "check-config",
                                  "check a cell file, or the settings of a job, and show what is wrong");
  auto* file = command->add_option("FILE", flags->cell_file, "a cell file, or the name of a cell");
  auto* cell = command->add_option("--cell", flags->cell, "instead: the name of a cell (default: default)");
  auto* settings =
      command->add_option("--settings", flags->settings_file, "instead: a file with settings of a job");
  file->excludes(cell)->excludes(settings);
  cell->excludes(settings);
  command->callback([&context, flags] {
    context.action = [&context, flags] {
      return flags->settings_file.empty() ? check_cell(context, *flags)
                                          : check_settings(context, flags->settings_file);
    };
  });
}

}  // namespace hilbrush
