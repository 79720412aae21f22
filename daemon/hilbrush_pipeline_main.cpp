// hilbrush-pipeline: all work on a mesh, as a child process of `hilbrush` and `hilbrushd`.
// It prints JSON lines on standard output:
//   {"stage":"plan","fraction":0.4}   {"warning":"..."}   and last   {"result":{...}}   or
//   {"error":{"at":"cup.wrl:12","message":"..."}}
// Exit codes: 0 ok, 1 internal failure, 2 wrong usage, 3 bad input.

#include <CLI/CLI.hpp>
#include <chrono>
#include <iostream>
#include <new>
#include <nlohmann/json.hpp>

#include "config/cell_file.h"
#include "daemon/pipeline/pipeline.h"
#include "daemon/pipeline/quality/quality.h"
#include "planner/cell_model/program_file.h"
#include "sampling/base/input_error.h"

namespace {

using Json = nlohmann::ordered_json;
using namespace hilbrush;

enum ExitCode { kOk = 0, kInternal = 1, kUsage = 2, kBadInput = 3 };

void print_line(const Json& line) {
  std::cout << line.dump(-1, ' ', false, Json::error_handler_t::replace) << std::endl;
}

/// Prints every change of stage, and within a stage at most ten lines a second.
class ProgressLines {
 public:
  void operator()(const char* stage, double fraction) {
    const auto now = std::chrono::steady_clock::now();
    if (stage_ == stage && now - last_ < std::chrono::milliseconds(100)) return;
    stage_ = stage;
    last_ = now;
    print_line({{"stage", stage}, {"fraction", fraction}});
  }

 private:
  std::string stage_;
  std::chrono::steady_clock::time_point last_;
};

struct Arguments {
  std::string model, cell, output, program, emissions, measured;
  std::string settings_json = "{}";
  std::string request_json;
  bool wedge = false;
  std::vector<double> from;
  std::size_t next = 0;
};

PipelineRequest request_of(const Arguments& arguments) {
  PipelineRequest request;
  request.model = arguments.model;
  request.settings = job_settings_from_json(arguments.settings_json);
  request.cell_file = arguments.cell.empty() ? find_cell(request.settings.cell) : find_cell(arguments.cell);
  request.output = arguments.output;
  return request;
}

Json run(const std::string& command, const Arguments& arguments, const PipelineListener& listener) {
  if (command == "files") {
    Json files = Json::array();
    for (const auto& file : run_files(arguments.model)) files.push_back(file.string());
    return {{"files", files}};
  }
  if (command == "quality")
    return Json::parse(
        run_quality(quality_request_from_json(arguments.request_json), arguments.output, listener));
  const PipelineRequest request = request_of(arguments);
  if (command == "plan") return Json::parse(run_plan(request, listener));
  if (command == "dry-run") return Json::parse(run_dry_run(request, listener));
  if (command == "develop")
    return Json::parse(run_develop(request, arguments.program, arguments.emissions, listener));
  if (command == "calibrate" && arguments.wedge) return Json::parse(run_wedge(request));
  if (command == "calibrate") return Json::parse(run_calibrate(request, arguments.measured, listener));

  Joints from{};
  std::copy(arguments.from.begin(), arguments.from.end(), from.begin());
  Json vias = Json::array();
  for (const Joints& joints : run_approach(request, arguments.program, arguments.next, from))
    vias.push_back(joints);
  return {{"via", vias}};
}

/// Of "file: sentence", the sentence.
std::string without_file(const std::string& text, const std::string& file) {
  return !file.empty() && text.starts_with(file + ": ") ? text.substr(file.size() + 2) : text;
}

int run_and_answer(const std::string& command, const Arguments& arguments) {
  ProgressLines progress;
  const PipelineListener listener{
      [&progress](const char* stage, double fraction) { progress(stage, fraction); },
      [](const std::string& sentence) {
        print_line({{"warning", sentence}});
      }};
  const auto fail = [](const std::string& at, const std::string& message, ExitCode code) {
    print_line({{"error", {{"at", at}, {"message", message}}}});
    return code;
  };
  try {
    print_line({{"result", run(command, arguments, listener)}});
    return std::cout ? kOk : kInternal;  // the result is not delivered if standard output cannot be written
  } catch (const InputError& error) {
    return fail(error.at(), error.sentence(), kBadInput);
  } catch (const ProgramFileError& error) {
    return fail(arguments.program, without_file(error.what(), arguments.program), kBadInput);
  } catch (const std::bad_alloc&) {
    return fail(arguments.model, "the model needs more memory than there is", kInternal);
  } catch (const std::exception& error) {
    return fail("", error.what(), kInternal);
  }
}

void add_commands(CLI::App& app, Arguments& arguments) {
  const auto add = [&](const char* name, const char* what, bool has_model, bool has_output) {
    CLI::App* command = app.add_subcommand(name, what);
    if (has_model) command->add_option("--model", arguments.model, "model file")->required();
    if (std::string(name) != "files" && std::string(name) != "quality") {
      command->add_option("--settings-json", arguments.settings_json, "job settings, a JSON object");
      command->add_option("--cell", arguments.cell, "cell file or name (default: the settings' cell)");
    }
    if (has_output)
      command->add_option("--output", arguments.output, "folder for all files written")->required();
    return command;
  };
  add("files", "list all files that the model is read from", true, false);
  add("plan", "write program.ply, dots.ply and report.json", true, true);
  add("dry-run", "plan, paint on the simulated cell, develop", true, true);
  CLI::App* develop =
      add("develop", "develop the film from the emissions that a simulated cell recorded", true, true);
  develop->add_option("--program", arguments.program, "program file")->required();
  develop->add_option("--emissions", arguments.emissions, "the cell's record of emissions")->required();
  CLI::App* calibrate = add("calibrate", "make a tone curve from a gray wedge", false, true);
  auto* measured =
      calibrate->add_option("--measured", arguments.measured, "readings of a wedge that was painted");
  calibrate->add_flag("--wedge", arguments.wedge, "write a wedge to paint and measure")->excludes(measured);
  add("quality", "measure how evenly dots lie", false, true)
      ->add_option("--request-json", arguments.request_json, "what to measure, a JSON object")
      ->required();
  CLI::App* approach = add("approach", "plan the path from measured joints to an exposure", true, false);
  approach->add_option("--program", arguments.program, "program file")->required();
  approach->add_option("--next", arguments.next, "index of the exposure to reach")->required();
  approach->add_option("--from", arguments.from, "j1,j2,j3,j4,a,c in rad and m")
      ->required()
      ->delimiter(',')
      ->expected(static_cast<int>(kAxisCount));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Hilbrush's pipeline: from a model to dots, poses, exposures and pictures. Run by hilbrush and "
      "hilbrushd; see "
      "`hilbrush --help`."};
  app.set_version_flag("--version", std::string("hilbrush-pipeline ") + HILBRUSH_VERSION);
  app.require_subcommand(1);
  Arguments arguments;
  add_commands(app, arguments);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kOk : kUsage;
  }
  return run_and_answer(app.get_subcommands().front()->get_name(), arguments);
}
