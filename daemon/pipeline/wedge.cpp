#include "daemon/pipeline/wedge.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "config/json_reader.h"
#include "sampling/base/input_error.h"

namespace hilbrush {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kFieldPitches = 60;
constexpr double kMinFieldM = .010;
constexpr double kGapM = .003;
/// Of asked_max. Closer together where the response of paint is most curved.
constexpr std::array kShares{.02, .05, .08, .12, .16, .2, .25, .3, .36, .43, .5, .6, .7, .8, .9, 1.};
static_assert(kShares.size() == WedgeCard::kColumns * WedgeCard::kRows);
constexpr std::size_t kMaxFormBytes = 1u << 20;
constexpr std::size_t kMaxSteps = 1000;

/// IEC 61966-2-1, as model files store colors.
double srgb_of_linear(double linear) {
  return linear <= .0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - .055;
}

/// Positions of the lines between gaps and fields: gap, field, gap, ..., gap.
std::vector<double> lines(int fields, const WedgeCard& card) {
  std::vector<double> at{0};
  for (int i = 0; i < fields; ++i) {
    at.push_back(at.back() + card.gap_m);
    at.push_back(at.back() + card.field_m);
  }
  at.push_back(at.back() + card.gap_m);
  return at;
}

double coverage_of(const JsonObject& json, double reflectance, const CellDescription::Paint& paint) {
  const double coverage = (paint.reflectance_white - reflectance) / (paint.reflectance_white - paint.reflectance_black);
  constexpr double kNoise = .05;  // coverage; readings of white and black scatter around the values of the cell file
  if (coverage < -kNoise || coverage > 1 + kNoise)
    json.refuse("reflectance", "is lighter than the paint's reflectance_white or darker than its reflectance_black");
  return std::clamp(coverage, 0., 1.);
}

WedgeStep read_step(JsonObject& json, const CellDescription& cell) {
  WedgeStep step;
  step.asked = json.number("asked", {0, cell.paint.asked_max});
  json.optional_integer("row", 1, kMaxSteps);  // to find the field on the card
  json.optional_integer("column", 1, kMaxSteps);
  const auto painted = json.optional_number("painted", {0, 1});
  const auto reflectance = json.optional_number("reflectance", {0, 1});
  if (painted && reflectance) json.refuse("reflectance", "contradicts painted: give one of the two");
  if (!painted && !reflectance) json.refuse("painted", "has no reading yet: measure the field and fill it in");
  step.painted = painted ? *painted : coverage_of(json, *reflectance, cell.paint);
  return step;
}

void refuse_other_placement(JsonObject& json, const JobSettings& settings) {
  const auto refuse_other = [&](const char* key, const std::string& painted, const std::string& wanted) {
    if (painted != wanted)
      json.refuse(key, "the wedge was painted with " + painted + ", but the settings say " + wanted +
                           ": give the settings it was painted with (--settings wedge.json)");
  };
  refuse_other("sampler", json.text("sampler", 40), sampler_name(settings.sampler));
  refuse_other("curve", json.text("curve", 40), curve_name(settings.curve));
  refuse_other("levels", std::to_string(json.integer("levels", 1, 4)), std::to_string(settings.levels));
  const double dpi = json.number("dpi", {10, 1200});
  if (!settings.dpi || std::abs(dpi - *settings.dpi) > 1e-6 * dpi)
    json.refuse("dpi", "the settings have another: give the settings it was painted with (--settings wedge.json)");
}

}  // namespace

WedgeCard wedge_card(double pitch_m, double asked_max, std::span<const double> levels) {
  return {std::max(kFieldPitches * pitch_m, kMinFieldM), kGapM,
          wedge_steps({kShares.begin(), kShares.end()}, asked_max, levels)};
}

std::string wedge_model(const WedgeCard& card, const CellDescription::Paint& paint) {
  const std::vector<double> x = lines(WedgeCard::kColumns, card);
  const std::vector<double> z = lines(WedgeCard::kRows, card);
  const int columns = static_cast<int>(x.size()) - 1;
  const int rows = static_cast<int>(z.size()) - 1;
  std::ostringstream points, faces, colors;
  points.precision(12);
  colors.precision(9);
  for (const double pz : z)
    for (const double px : x) points << px << " 0 " << pz << ", ";
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const int corner = row * (columns + 1) + column;
      // Counter-clockwise as seen from +y.
      faces << corner << ' ' << corner + columns + 1 << ' ' << corner + columns + 2 << ' ' << corner + 1 << " -1, ";
      double wanted = 0;
      if (row % 2 == 1 && column % 2 == 1)
        wanted = card.asked[static_cast<std::size_t>(row / 2 * WedgeCard::kColumns + column / 2)] / card.asked.back();
      else if (row == 0 && column == 0)
        wanted = 1;
      const double srgb =
          srgb_of_linear(paint.reflectance_white - wanted * (paint.reflectance_white - paint.reflectance_black));
      colors << srgb << ' ' << srgb << ' ' << srgb << ", ";
    }
  return "#VRML V2.0 utf8\n# A gray wedge: " + std::to_string(WedgeCard::kRows) + " rows of " +
         std::to_string(WedgeCard::kColumns) + " fields, the lightest beside the black corner.\n" +
         "Shape { geometry IndexedFaceSet {\n  colorPerVertex FALSE\n  coord Coordinate { point [ " + points.str() +
         "] }\n  coordIndex [ " + faces.str() + "]\n  color Color { color [ " + colors.str() + "] }\n} }\n";
}

JobSettings wedge_settings(const JobSettings& settings) {
  if (!settings.dpi)
    throw InputError("--dots", "a wedge needs the dpi that its tone curve is for, not a number of dots");
  JobSettings wedge = settings;
  wedge.tone_curve = ToneMapping::kLinear;
  wedge.density = DensitySource::kTexture;
  wedge.untextured = Untextured::kMaterial;
  wedge.predictive_rounds = 0;
  wedge.largest_gap_pitches.reset();
  wedge.size_mm.reset();
  wedge.units_mm.reset();
  wedge.up.reset();
  return wedge;
}

std::string wedge_form(const WedgeCard& card, const JobSettings& settings) {
  Json steps = Json::array();
  for (std::size_t i = 0; i < card.asked.size(); ++i)
    steps.push_back({{"row", i / WedgeCard::kColumns + 1},
                     {"column", i % WedgeCard::kColumns + 1},
                     {"asked", card.asked[i]},
                     {"painted", nullptr}});
  const Json form{{"sampler", sampler_name(settings.sampler)},
                  {"curve", curve_name(settings.curve)},
                  {"levels", settings.levels},
                  {"dpi", settings.dpi.value()},
                  {"steps", steps}};
  return form.dump(2) + "\n";
}

std::vector<WedgeStep> read_wedge_form(const std::filesystem::path& file, const JobSettings& settings,
                                       const CellDescription& cell) {
  std::vector<WedgeStep> steps;
  read_json_object(read_text_file(file.string(), kMaxFormBytes), file.string(), [&](JsonObject& json) {
    refuse_other_placement(json, settings);
    json.objects("steps", kMaxSteps, [&](JsonObject& step) { steps.push_back(read_step(step, cell)); });
  });
  return steps;
}

}  // namespace hilbrush
