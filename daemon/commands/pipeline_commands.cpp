#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <ostream>

#include "config/cell_file.h"
#include "config/job_settings.h"
#include "config/json_reader.h"
#include "daemon/commands/command_context.h"
#include "daemon/commands/exit_code.h"
#include "daemon/commands/given_files.h"
#include "daemon/commands/pipeline_run.h"
#include "daemon/commands/progress_display.h"
#include "daemon/commands/settings_flags.h"
#include "daemon/commands/text_output.h"

namespace hilbrush {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::array kStages{"load", "disk", "curve", "dots", "plan", "check", "execute", "paint", "images"};

struct PipelineFlags {
  std::string command, model, output, program, emissions, measured;
  bool is_wedge = false;
  SettingsFlags settings;
};

/// "plan 40 % (stage 5 of 9)".
std::string stage_text(const std::string& stage, double fraction) {
  std::string text = stage + " " + std::to_string(static_cast<int>(100 * fraction)) + " %";
  if (const auto found = std::find(kStages.begin(), kStages.end(), stage); found != kStages.end())
    text += " (stage " + std::to_string(found - kStages.begin() + 1) + " of " +
            std::to_string(kStages.size()) + ")";
  return text;
}

std::vector<std::string> child_arguments(const PipelineFlags& flags, const JobSettings& settings,
                                         const fs::path& cell) {
  std::vector<std::string> arguments{flags.command};
  const auto add = [&](const char* name, const std::string& value) {
    arguments.emplace_back(name);
    arguments.push_back(value);
  };
  if (!flags.model.empty()) add("--model", existing_file(flags.model, "model"));
  add("--settings-json", job_settings_to_json(settings));
  add("--cell", fs::absolute(cell).lexically_normal().string());
  add("--output", fs::absolute(flags.output).lexically_normal().string());
  if (!flags.program.empty()) add("--program", existing_file(flags.program, "program"));
  if (!flags.emissions.empty()) add("--emissions", existing_file(flags.emissions, "record of emissions"));
  if (!flags.measured.empty()) add("--measured", existing_file(flags.measured, "readings of a wedge"));
  if (flags.is_wedge) arguments.emplace_back("--wedge");
  return arguments;
}

void print_files(std::ostream& out, const fs::path& output) {
  struct Line {
    const char *label, *file;
  };
  constexpr std::array kLines{Line{"report", "report.json"},
                              Line{"pictures", "exposure.png"},
                              Line{"views", "views"},
                              Line{"program", "program.ply"},
                              Line{"dots", "dots.ply"},
                              Line{"tone curve", "tone_curve.json"},
                              Line{"wedge", "wedge.wrl"},
                              Line{"its settings", "wedge.json"},
                              Line{"its readings", "wedge_steps.json"}};
  std::error_code error;
  for (const Line& line : kLines) {
    if (!fs::exists(output / line.file, error)) continue;
    std::string label = std::string(line.label) + ":";
    label.resize(15, ' ');
    out << "  " << label << printable((output / line.file).string()) << '\n';
  }
}

/// Whether dots were placed, but none can be exposed: the run has done its work, and there is no picture.
bool is_all_skipped(const Json& report) {
  const Json& dots = member(report, "dots");
  return number_field(dots, "placed") > 0 &&
         number_field(dots, "exposed") + number_field(dots, "remaining") + number_field(dots, "in_doubt") ==
             0;
}

int run_pipeline(CommandContext& context, const PipelineFlags& flags) {
  const std::string beside = flags.program.empty() ? std::string() : settings_beside(flags.program);
  const JobSettings settings = job_settings_from_json(flags.settings.to_json(beside, "report.json"));
  const fs::path cell = find_cell(settings.cell);
  load_cell(cell);  // so that a bad cell file is refused before the model is read
  const std::vector<std::string> arguments = child_arguments(flags, settings, cell);

  std::string result;
  {
    ProgressDisplay display(context.terminal, context.is_json);
    PipelineRunListener listener;
    listener.on_progress = [&](const std::string& stage, double fraction) {
      display.show(stage, fraction,
                   context.terminal.out_is_terminal ? stage_text(stage, fraction) : "stage: " + stage);
    };
    listener.on_warning = [&](const std::string& sentence) { display.print_above("warning: " + sentence); };
    result = run_pipeline_program(find_pipeline_program(), arguments, listener);
  }

  const Json json = Json::parse(result);
  const int exit_code = is_all_skipped(json) ? kExitJobFailed : kExitOk;
  if (context.is_json) {
    context.terminal.out << result << std::endl;
    return exit_code;
  }
  if (!flags.is_wedge)
    context.terminal.out << (flags.command == "calibrate" ? format_tone_curve(json) : format_report(json));
  print_files(context.terminal.out, flags.output);
  return exit_code;
}

struct DeclaredRun {
  CLI::App* app;
  std::shared_ptr<PipelineFlags> flags;
};

DeclaredRun declare(CLI::App& app, CommandContext& context, const std::string& name,
                    const std::string& description) {
  auto flags = std::make_shared<PipelineFlags>();
  flags->command = name;
  CLI::App* command = add_command(app, context, name, description);
  command->add_option("-o,--output", flags->output, "folder for the results, made if absent")->required();
  command->callback(
      [&context, flags] { context.action = [&context, flags] { return run_pipeline(context, *flags); }; });
  return {command, flags};
}

void add_model(const DeclaredRun& declared) {
  declared.app->add_option("MODEL", declared.flags->model, "VRML, OBJ, PLY, OFF or STL file")->required();
  declared.flags->settings.add_to(*declared.app);
}

}  // namespace

void add_pipeline_commands(CLI::App& app, CommandContext& context) {
  add_model(declare(app, context, "dry-run",
                    "plan a model, paint it on the simulated cell and write pictures; needs no daemon"));
  add_model(
      declare(app, context, "plan", "make the dots and the exposure program of a model, without painting"));

  const DeclaredRun develop =
      declare(app, context, "develop", "write the pictures of a job that a simulated cell has painted");
  add_model(develop);
  develop.app
      ->add_option("--program", develop.flags->program,
                   "the program that was painted; settings default to those in the report.json beside it")
      ->required();
  develop.app->add_option("--emissions", develop.flags->emissions, "the cell's record of emissions")
      ->required();

  const DeclaredRun calibrate = declare(
      app, context, "calibrate", "make a tone curve from a gray wedge, simulated or painted and measured");
  auto* measured =
      calibrate.app->add_option("--measured", calibrate.flags->measured,
                                "the wedge_steps.json of a painted wedge, with the readings filled in");
  calibrate.app
      ->add_flag(
          "--wedge", calibrate.flags->is_wedge,
          "write a wedge to paint: wedge.wrl, its settings wedge.json, and wedge_steps.json to fill in")
      ->excludes(measured);
  calibrate.flags->settings.add_paint_flags_to(*calibrate.app);
}

}  // namespace hilbrush
