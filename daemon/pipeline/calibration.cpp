#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "config/cell_file.h"
#include "daemon/pipeline/job_sampling.h"
#include "daemon/pipeline/output_files.h"
#include "daemon/pipeline/pipeline.h"
#include "daemon/pipeline/report.h"
#include "daemon/pipeline/wedge.h"
#include "sampling/base/input_error.h"
#include "sampling/tone/levels.h"

namespace hilbrush {
namespace {

/// Of job settings. If the cell file gives the spot in pitches, the tone curve does not depend on it.
constexpr double kDefaultDpi = 100;

double pitch_of(const JobSettings& settings) {
  return 25.4e-3 / settings.dpi.value_or(kDefaultDpi);
}

ToneCurve simulated_curve(const CellDescription& cell, const JobSettings& settings,
                          const PictureOptions& options) {
  const Wedge wedge = wedge_on_film(cell, pitch_of(settings), options);
  if (options.levels.size() == 1) return calibrate_tone(wedge, cell.paint.asked_max);
  constexpr int kSteps = 64;
  std::vector<double> shares;
  for (int i = 1; i <= kSteps; ++i) shares.push_back(static_cast<double>(i) / kSteps);
  return tone_curve_of(wedge(wedge_steps(shares, cell.paint.asked_max, options.levels)), cell.paint.asked_max,
                       options.levels);
}

ToneCurve measured_curve(const CellDescription& cell, const JobSettings& settings,
                         const PictureOptions& options, const std::filesystem::path& measured) {
  const std::vector<WedgeStep> steps = read_wedge_form(measured, settings, cell);
  try {
    return tone_curve_of(steps, cell.paint.asked_max, options.levels);
  } catch (const InputError& error) {
    throw InputError(measured.string(), error.sentence());
  }
}

std::string curve_entry(const ToneCurve& curve, const JobSettings& settings, const CellDescription& cell) {
  const auto rounded = [](std::vector<double> values) {
    for (double& value : values) value = std::round(value * 1e4) / 1e4;
    return values;
  };
  const double pitch_m = pitch_of(settings);
  const nlohmann::ordered_json entry{
      {"sampler", sampler_name(settings.sampler)},
      {"curve", curve_name(settings.curve)},
      {"levels", settings.levels},
      {"spot_pitches", std::round(spot_diameter_m(cell, pitch_m) / pitch_m * 1e4) / 1e4},
      {"wanted", rounded(curve.wanted)},
      {"asked", rounded(curve.asked)}};
  return entry.dump(2) + "\n";
}

}  // namespace

std::string run_calibrate(const PipelineRequest& request, const std::filesystem::path& measured,
                          const PipelineListener& listener) {
  make_output_folder(request.output);
  const CellDescription cell = load_cell(request.cell_file);
  if (calibrated_sampler(request.settings.sampler) != request.settings.sampler)
    throw InputError("sampler",
                     std::string(sampler_name(request.settings.sampler)) + " uses the tone curve of " +
                         sampler_name(calibrated_sampler(request.settings.sampler)) + ": calibrate that");
  if (listener.on_progress) listener.on_progress("paint", 0);
  const PictureOptions options = picture_options(cell, request.settings);
  const ToneCurve curve = measured.empty() ? simulated_curve(cell, request.settings, options)
                                           : measured_curve(cell, request.settings, options, measured);
  const std::string text = curve_entry(curve, request.settings, cell);
  write_text_file(request.output / "tone_curve.json", text);
  return text;
}

std::string run_wedge(const PipelineRequest& request) {
  make_output_folder(request.output);
  const CellDescription cell = load_cell(request.cell_file);
  const JobSettings settings = wedge_settings(request.settings);
  const WedgeCard card = wedge_card(pitch_of(settings), cell.paint.asked_max,
                                    energy_levels(settings.levels, cell.paint.asked_max));
  write_text_file(request.output / "wedge.wrl", wedge_model(card, cell.paint));
  write_text_file(request.output / "wedge.json", job_settings_to_json(settings) + "\n");
  write_text_file(request.output / "wedge_steps.json", wedge_form(card, settings));
  const nlohmann::ordered_json result{{"fields", card.asked.size()},
                                      {"width_mm", card.width_m() * 1e3},
                                      {"height_mm", card.height_m() * 1e3},
                                      {"files", {"wedge.wrl", "wedge.json", "wedge_steps.json"}}};
  return result.dump(2) + "\n";
}

}  // namespace hilbrush
