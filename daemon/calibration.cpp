#include <nlohmann/json.hpp>
#include <string>

#include "config/cell_file.h"
#include "daemon/pipeline.h"
#include "daemon/report.h"
#include "sampling/input_error.h"
#include "sim/film/calibrate.h"

namespace hilbrush {
namespace {

constexpr double kCalibrationDpi = 100;  // the curve depends on the spot in pitches, not on the pitch

}  // namespace

std::string run_calibrate(const PipelineRequest& request, const PipelineListener& listener) {
  std::error_code error;
  std::filesystem::create_directories(request.output, error);
  const CellDescription cell = load_cell(request.cell_file);
  SampleOptions options = sample_options(request.settings);
  options.dot_count.reset();
  const double pitch_m = 25.4e-3 / request.settings.dpi.value_or(kCalibrationDpi);
  options.pitch_m = pitch_m;

  if (listener.on_progress) listener.on_progress("paint", 0);
  const ToneCurve curve = calibrate_tone(wedge_on_film(cell, pitch_m, options), cell.paint.asked_max);
  const nlohmann::ordered_json entry{
      {"sampler", sampler_name(request.settings.sampler)}, {"wanted", curve.wanted}, {"asked", curve.asked}};
  const std::string text = entry.dump(2) + "\n";
  write_text_file(request.output / "tone_curve.json", text);
  return text;
}

}  // namespace hilbrush
