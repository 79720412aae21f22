#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "config/cell_file.h"
#include "daemon/job_sampling.h"
#include "daemon/pipeline.h"
#include "daemon/report.h"
#include "daemon/wedge.h"
#include "sampling/input_error.h"

namespace hilbrush {
namespace {

constexpr double kDefaultDpi = 100;  // where the spot is given in pitches the curve does not depend on the pitch

void make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
}

double pitch_of(const JobSettings& settings) {
  return 25.4e-3 / settings.dpi.value_or(kDefaultDpi);
}

std::string curve_entry(const ToneCurve& curve, const JobSettings& settings, const CellDescription& cell) {
  const auto rounded = [](std::vector<double> values) {
    for (double& value : values) value = std::round(value * 1e4) / 1e4;
    return values;
  };
  const double pitch_m = pitch_of(settings);
  const nlohmann::ordered_json entry{{"sampler", sampler_name(settings.sampler)},
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
  make_folder(request.output);
  const CellDescription cell = load_cell(request.cell_file);
  if (listener.on_progress) listener.on_progress("paint", 0);
  ToneCurve curve;
  if (measured.empty()) {
    curve = calibrate_tone(wedge_on_film(cell, pitch_of(request.settings), picture_options(cell, request.settings)),
                           cell.paint.asked_max);
  } else {
    try {
      curve = tone_curve_of(read_wedge_form(measured, request.settings, cell), cell.paint.asked_max);
    } catch (const InputError& error) {
      throw error.at().empty() ? InputError(measured.string(), error.sentence()) : error;
    }
  }
  const std::string text = curve_entry(curve, request.settings, cell);
  write_text_file(request.output / "tone_curve.json", text);
  return text;
}

std::string run_wedge(const PipelineRequest& request) {
  make_folder(request.output);
  const CellDescription cell = load_cell(request.cell_file);
  const JobSettings settings = wedge_settings(request.settings);
  const WedgeCard card = wedge_card(pitch_of(settings), cell.paint.asked_max);
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
