#include "daemon/pipeline/wedge.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <sstream>
#include <utility>

#include "config/json_reader.h"
#include "sampling/base/input_error.h"
#include "sampling/base/text.h"
#include "sampling/tone/levels.h"

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
  const double coverage =
      (paint.reflectance_white - reflectance) / (paint.reflectance_white - paint.reflectance_black);
  constexpr double kNoise =
      .05;  // coverage; readings of white and black scatter around the values of the cell file
  if (coverage < -kNoise || coverage > 1 + kNoise)
    json.refuse("reflectance",
                "is lighter than the paint's reflectance_white or darker than its reflectance_black");
  return std::clamp(coverage, 0., 1.);
}

/// A step as it stands in the form.
struct Reading {
  WedgeStep step;
  std::optional<std::uint64_t> row, column;  ///< of the field on the card
};

Reading read_step(JsonObject& json, const CellDescription& cell) {
  Reading reading;
  WedgeStep& step = reading.step;
  step.asked = json.number("asked", {0, cell.paint.asked_max});
  reading.row = json.optional_integer("row", 1, kMaxSteps);
  reading.column = json.optional_integer("column", 1, kMaxSteps);
  const auto painted = json.optional_number("painted", {0, 1});
  const auto reflectance = json.optional_number("reflectance", {0, 1});
  if (painted && reflectance) json.refuse("reflectance", "contradicts painted: give one of the two");
  if (!painted && !reflectance)
    json.refuse("painted", "has no reading yet: measure the field and fill it in");
  step.painted = painted ? *painted : coverage_of(json, *reflectance, cell.paint);
  return reading;
}

std::string field_name(const Reading& reading) {
  if (!reading.row || !reading.column) return "the field asked for " + number(reading.step.asked, 4);
  return "row " + std::to_string(*reading.row) + ", column " + std::to_string(*reading.column);
}

/// The card of wedge_card() has all its fields, each once. Steps without row and column are of another card.
void refuse_missing_fields(const JsonObject& json, const std::vector<Reading>& readings) {
  std::map<std::pair<std::uint64_t, std::uint64_t>, int> times;
  for (const Reading& reading : readings)
    if (reading.row && reading.column) ++times[{*reading.row, *reading.column}];
  if (times.empty()) return;
  for (std::uint64_t row = 1; row <= WedgeCard::kRows; ++row)
    for (std::uint64_t column = 1; column <= WedgeCard::kColumns; ++column)
      if (const int count = times[{row, column}]; count != 1)
        json.refuse("steps", "the field in row " + std::to_string(row) + ", column " +
                                 std::to_string(column) +
                                 (count == 0 ? " is missing" : " stands there twice") +
                                 ": a curve needs each field of the card once");
}

/// More paint was asked of each field than of the one before, among those of the same energy: a reading that
/// falls is wrong, or the one before it is. What is read of a saturated paint scatters by less than kNoise.
void refuse_falling_readings(const JsonObject& json, std::vector<Reading> readings,
                             std::span<const double> levels) {
  constexpr double kNoise = .02;
  std::stable_sort(readings.begin(), readings.end(),
                   [](const Reading& a, const Reading& b) { return a.step.asked < b.step.asked; });
  for (std::size_t i = 1; i < readings.size(); ++i) {
    const WedgeStep& before = readings[i - 1].step;
    const WedgeStep& step = readings[i].step;
    if (level_for(levels, before.asked) != level_for(levels, step.asked))
      continue;  // fewer, stronger dots cover less
    if (step.painted < before.painted - kNoise)
      json.refuse("steps", field_name(readings[i]) + " reads " + number(step.painted, 3) + ", but " +
                               field_name(readings[i - 1]) + ", which was asked for less, reads " +
                               number(before.painted, 3) + ": one of them is wrong; measure both again");
  }
}

void refuse_equal_readings(const JsonObject& json, const std::vector<Reading>& readings) {
  constexpr double kMinRange = .1;  // of coverage, from the lightest field to the darkest
  if (readings.size() < 2) return;
  const auto [least, most] =
      std::minmax_element(readings.begin(), readings.end(),
                          [](const Reading& a, const Reading& b) { return a.step.painted < b.step.painted; });
  if (most->step.painted - least->step.painted < kMinRange)
    json.refuse("steps", "all fields read nearly the same, " + number(least->step.painted, 3) + " to " +
                             number(most->step.painted, 3) + ": was each of them measured?");
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
    json.refuse("dpi",
                "the settings have another: give the settings it was painted with (--settings wedge.json)");
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
      faces << corner << ' ' << corner + columns + 1 << ' ' << corner + columns + 2 << ' ' << corner + 1
            << " -1, ";
      double wanted = 0;
      if (row % 2 == 1 && column % 2 == 1)
        wanted = card.asked[static_cast<std::size_t>(row / 2 * WedgeCard::kColumns + column / 2)] /
                 card.asked.back();
      else if (row == 0 && column == 0)
        wanted = 1;
      const double srgb = srgb_of_linear(paint.reflectance_white -
                                         wanted * (paint.reflectance_white - paint.reflectance_black));
      colors << srgb << ' ' << srgb << ' ' << srgb << ", ";
    }
  return "#VRML V2.0 utf8\n# A gray wedge: " + std::to_string(WedgeCard::kRows) + " rows of " +
         std::to_string(WedgeCard::kColumns) + " fields, the lightest beside the black corner.\n" +
         "Shape { geometry IndexedFaceSet {\n  colorPerVertex FALSE\n  coord Coordinate { point [ " +
         points.str() + "] }\n  coordIndex [ " + faces.str() + "]\n  color Color { color [ " + colors.str() +
         "] }\n} }\n";
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

/// In the form itself, because that is what the person with the densitometer has at hand.
constexpr const char* kHowToMeasure =
    "Measure the middle of each field: row 1, column 1 is beside the black corner. painted is the part of "
    "the field "
    "that "
    "the paint covers, 0 (as the bare white) to 1 (as the black corner): (white - field) / (white - black), "
    "each a "
    "reflectance in linear light. Or give reflectance (0 to 1) instead of painted; the cell file's paint "
    "then says "
    "what "
    "white and black are. asked is what was asked for: leave it.";
constexpr std::size_t kMaxHowToMeasure = 1000;  // bytes

std::string wedge_form(const WedgeCard& card, const JobSettings& settings) {
  Json steps = Json::array();
  for (std::size_t i = 0; i < card.asked.size(); ++i)
    steps.push_back({{"row", i / WedgeCard::kColumns + 1},
                     {"column", i % WedgeCard::kColumns + 1},
                     {"asked", card.asked[i]},
                     {"painted", nullptr}});
  const Json form{{"measure", kHowToMeasure},
                  {"sampler", sampler_name(settings.sampler)},
                  {"curve", curve_name(settings.curve)},
                  {"levels", settings.levels},
                  {"dpi", settings.dpi.value()},
                  {"steps", steps}};
  return form.dump(2) + "\n";
}

std::vector<WedgeStep> read_wedge_form(const std::filesystem::path& file, const JobSettings& settings,
                                       const CellDescription& cell) {
  std::vector<Reading> readings;
  read_json_object(read_text_file(file.string(), kMaxFormBytes), file.string(), [&](JsonObject& json) {
    json.optional_text("measure", kMaxHowToMeasure);
    refuse_other_placement(json, settings);
    json.objects("steps", kMaxSteps, [&](JsonObject& step) { readings.push_back(read_step(step, cell)); });
    refuse_missing_fields(json, readings);
    refuse_equal_readings(json, readings);
    refuse_falling_readings(json, readings, energy_levels(settings.levels, cell.paint.asked_max));
  });
  std::vector<WedgeStep> steps;
  for (const Reading& reading : readings) steps.push_back(reading.step);
  return steps;
}

}  // namespace hilbrush
