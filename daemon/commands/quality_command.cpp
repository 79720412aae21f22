#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>
#include <sstream>
#include <vector>

#include "config/json_reader.h"
#include "daemon/commands/command_context.h"
#include "daemon/commands/exit_code.h"
#include "daemon/commands/given_files.h"
#include "daemon/commands/number_checks.h"
#include "daemon/commands/pipeline_run.h"
#include "daemon/commands/progress_display.h"
#include "daemon/commands/text_output.h"

/// `hilbrush quality`: runs hilbrush-pipeline quality, which measures, and shows the figures.
namespace hilbrush {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct QualityFlags {
  std::string set, model, output, settings;
  std::string sampler, curve, area, density, points;
  std::vector<std::uint64_t> counts;
  std::optional<std::uint64_t> seed, shapes;
};

/// The settings that the dots were placed with: those of --settings, or of the report.json beside them.
std::string settings_of(const QualityFlags& flags) {
  if (!flags.settings.empty()) return read_text_file(flags.settings, kReportBytesMax);
  const fs::path report = fs::path(flags.set).parent_path() / "report.json";
  std::error_code error;
  if (!fs::exists(report, error))
    throw InputError(flags.set, "has no report.json beside it with the settings of its job: give --settings");
  const std::string settings = settings_beside(flags.set);
  if (settings.empty()) throw InputError(report.string(), "has no settings: give --settings");
  return settings;
}

std::string request_of(const QualityFlags& flags) {
  std::error_code error;
  Json json;
  if (!flags.model.empty()) {
    json["set"] = existing_file(flags.set, "file of dots");
    json["model"] = existing_file(flags.model, "model");
    json["settings"] = settings_of(flags);
  } else {
    json["set"] = fs::exists(flags.set, error) ? existing_file(flags.set, "model") : flags.set;
  }
  for (const auto& [key, value] : {std::pair{"sampler", &flags.sampler}, std::pair{"curve", &flags.curve},
                                   std::pair{"area", &flags.area}, std::pair{"density", &flags.density},
                                   std::pair{"points", &flags.points}})
    if (!value->empty()) json[key] = *value;
  if (!flags.counts.empty()) json["count"] = flags.counts;
  if (flags.seed) json["seed"] = *flags.seed;
  if (flags.shapes) json["shapes"] = *flags.shapes;
  try {
    return json.dump();
  } catch (const Json::type_error&) {
    throw InputError("flags", "a value is not UTF-8 text");
  }
}

/// "$.count[1]" -> "--count"; SET has no flag.
std::string flag_of(const std::string& at) {
  if (!at.starts_with("$.")) return at;
  const std::string key = at.substr(2, at.find_first_of("[.", 2) - 2);
  return key == "set" ? "SET" : "--" + key;
}

std::string number_text(const Json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (!value.is_number()) return "-";
  const double number = value.get<double>();
  std::ostringstream out;
  out << std::setprecision(3);
  if (number != 0 && std::abs(number) < .001) out << std::scientific << std::setprecision(2);
  out << number;
  return out.str();
}

std::string heading_text(std::string key) {
  std::replace(key.begin(), key.end(), '_', ' ');
  return key;
}

/// Rows of figures, one column for each count.
class FigureTable {
 public:
  explicit FigureTable(const Json& sizes) : sizes_(sizes) {}

  void add(const std::string& label, const Json::json_pointer& where, const Json& slope = {}) {
    std::string row = "  " + label;
    row.resize(40, ' ');
    bool any = false;
    for (const Json& size : sizes_) {
      const Json value = size.contains(where) ? size.at(where) : Json();
      any = any || value.is_number();
      row +=
          cell_text(where.to_string() == "/count" ? format_count(value.is_number() ? value.get<double>() : 0)
                                                  : number_text(value));
    }
    if (!slope.is_null()) row += cell_text(number_text(slope));
    if (any) text_ += row + '\n';
  }
  const std::string& text() const { return text_; }

 private:
  static std::string cell_text(const std::string& value) {
    constexpr std::size_t kWidth = 11;
    return std::string(value.size() < kWidth ? kWidth - value.size() : 1, ' ') + value;
  }
  const Json& sizes_;
  std::string text_;
};

std::string format_quality(const Json& json) {
  const Json& sizes = member(json, "sizes");
  if (!sizes.is_array() || sizes.empty()) return {};
  FigureTable table(sizes);
  table.add("dots", Json::json_pointer("/count"), sizes.size() > 1 ? Json("slope") : Json());
  for (const auto& [shapes, unused] : member(sizes.front(), "discrepancy").items()) {
    const Json& slopes = member(member(json, "slopes"), shapes.c_str());
    table.add("discrepancy, " + heading_text(shapes) + ", rms",
              Json::json_pointer("/discrepancy/" + shapes + "/rms"), member(slopes, "rms"));
    table.add("    largest", Json::json_pointer("/discrepancy/" + shapes + "/largest"),
              member(slopes, "largest"));
  }
  table.add("smallest spacing / densest packing", Json::json_pointer("/spacing/smallest"));
  table.add("mean spacing / densest packing", Json::json_pointer("/spacing/mean"));
  table.add("spread of the nearest distance", Json::json_pointer("/spacing/spread"));
  table.add("largest hole / sqrt(A/N)", Json::json_pointer("/largest_hole"));
  table.add("path constant", Json::json_pointer("/path_constant"));
  table.add("power below half the frequency", Json::json_pointer("/spectrum/below_half"));
  table.add("power below a quarter", Json::json_pointer("/spectrum/below_quarter"));
  table.add("highest power", Json::json_pointer("/spectrum/peak"));
  table.add("anisotropy", Json::json_pointer("/spectrum/anisotropy"));
  std::string text = table.text();
  const Json& reason = member(sizes.back(), "no_spectrum");
  if (reason.is_string()) text += "  no spectrum: " + printable(reason.get<std::string>()) + '\n';
  const Json& coherence = member(json, "coherence");
  if (coherence.is_object())
    for (const auto& [curve, figures] : coherence.items())
      text += "  coherence of " + printable(curve) + ": correlation " +
              number_text(member(figures, "correlation")) + ", Hoelder constant " +
              number_text(member(figures, "hoelder")) + '\n';
  return text;
}

int run(CommandContext& context, const QualityFlags& flags) {
  const std::vector<std::string> arguments{"quality", "--request-json", request_of(flags), "--output",
                                           fs::absolute(flags.output).lexically_normal().string()};
  std::string result;
  try {
    ProgressDisplay display(context.terminal, context.is_json);
    PipelineRunListener listener;
    listener.on_progress = [&](const std::string& stage, double fraction) {
      display.show(stage, fraction,
                   context.terminal.out_is_terminal
                       ? stage + " " + std::to_string(static_cast<int>(100 * fraction)) + " %"
                       : "stage: " + stage);
    };
    listener.on_warning = [&](const std::string& sentence) { display.print_above("note: " + sentence); };
    result = run_pipeline_program(find_pipeline_program(), arguments, listener);
  } catch (const PipelineFailure& failure) {
    throw PipelineFailure(failure.exit_code(), failure.what(), flag_of(failure.at()), failure.child_stderr());
  }
  if (context.is_json) {
    context.terminal.out << result << std::endl;
    return kExitOk;
  }
  const Json json = Json::parse(result);
  context.terminal.out << format_quality(json);
  for (const Json& file : member(json, "files"))
    if (file.is_string())
      context.terminal.out << "  " << printable((fs::path(flags.output) / file).string()) << '\n';
  return kExitOk;
}

}  // namespace

void add_quality_command(CLI::App& app, CommandContext& context) {
  auto flags = std::make_shared<QualityFlags>();
  CLI::App* command = add_command(
      app, context, "quality",
      "measure how evenly dots lie: discrepancy, spectrum, spacing, holes, path; needs no daemon");
  command
      ->add_option(
          "SET", flags->set,
          "what to measure: plane, sphere, monkey_saddle, eight_surface, whitney_umbrella, super_ellipsoid, "
          "super_ellipsoid_reparameterized or equal_area_sphere; or a model file, to place dots on; or with "
          "--model "
          "the dots.ply of a dry run")
      ->required();
  command->add_option("-o,--output", flags->output, "folder for quality.json and plots, made if absent")
      ->required();
  command->add_option("--model", flags->model, "the model that the dots of SET were placed on");
  command->add_option(
      "--settings", flags->settings,
      "JSON file with the settings of that job (default: those in the report.json beside SET)");
  command->add_option(
      "--sampler", flags->sampler,
      "how dots are placed: centroid (default), jittered, even, random, halton, hammersley, sobol, "
      "niederreiter; on models also blue");
  command->add_option("--curve", flags->curve, "hilbert (default) or peano2");
  command->add_option("--area", flags->area,
                      "of surfaces by name: triangle, square or first_fundamental_form (default)");
  command->add_option("--density", flags->density,
                      "constant (default); on surfaces by name also u, u+v, mean_curvature, "
                      "gaussian_curvature; on models also texture, mean_curvature, gaussian_curvature");
  command->add_option(
      "--points", flags->points,
      "instead of dots along a curve, in the plane or on the sphere: random, jittered, halton, "
      "hammersley, sobol or niederreiter");
  command->add_option("--count", flags->counts, "number of dots (default 10000); two or more give slopes")
      ->delimiter(',')
      ->check(not_negative());
  command->add_option("--seed", flags->seed, "of the random numbers (default 1)")->check(not_negative());
  command->add_option("--shapes", flags->shapes, "test shapes of each kind (default 1000)")
      ->check(not_negative());
  command->callback(
      [&context, flags] { context.action = [&context, flags] { return run(context, *flags); }; });
}

}  // namespace hilbrush
