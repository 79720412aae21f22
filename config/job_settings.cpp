#include "config/job_settings.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <vector>

#include "config/json_reader.h"
#include "sampling/base/angles.h"
#include "sampling/base/sha256.h"

namespace hilbrush {
namespace {

constexpr double kDefaultDpi = 100;
constexpr double kMetersPerInch = 0.0254;
constexpr std::uint64_t kDotsMax = 1'000'000'000;  // what memory allows is found by the pipeline
constexpr std::uint64_t kLevelsMax = 4;
constexpr std::size_t kSettingsBytesMax = 64u << 10;

const std::vector<std::string> kUpNames{"y", "z"};

/// The choice of an enum's value by its name, if there is one under `key`.
template <class Enum, std::size_t kCount>
void read_choice(JsonObject& json, const char* key, const EnumName<Enum> (&names)[kCount], Enum& value) {
  if (const auto choice = json.optional_choice(key, all_names(names))) value = names[*choice].value;
}

/// How many dots, and how large the object: of each pair at most one.
void read_amounts(JsonObject& json, JobSettings& settings) {
  settings.dpi = json.optional_number("dpi", {10, 1200});
  settings.dots = json.optional_integer("dots", 1, kDotsMax);
  settings.size_mm = json.optional_number("size_mm", {1, 1000});
  settings.units_mm = json.optional_number("units_mm", {1e-6, 1e6});
  if (settings.dpi && settings.dots) json.refuse("dots", "contradicts dpi: give dpi or dots, not both");
  if (settings.size_mm && settings.units_mm)
    json.refuse("units_mm", "contradicts size_mm: give size_mm or units_mm, not both");
  if (!settings.dpi && !settings.dots) settings.dpi = kDefaultDpi;
}

void read_incidence(JsonObject& json, JobSettings& settings) {
  settings.max_incidence_deg =
      json.optional_number("max_incidence_deg", {1, 45}).value_or(settings.max_incidence_deg);
  const std::optional<double> preferred = json.optional_number("preferred_incidence_deg", {0, 45});
  if (preferred && *preferred > settings.max_incidence_deg)
    json.refuse("preferred_incidence_deg", "above max_incidence_deg");
  settings.preferred_incidence_deg =
      preferred.value_or(std::min(settings.preferred_incidence_deg, settings.max_incidence_deg));
}

void read_planning(JsonObject& json, JobSettings& settings) {
  read_choice(json, "planning", kPlanningNames, settings.planning);
  read_choice(json, "order", kOrderNames, settings.order);
  read_choice(json, "policy", kPolicyNames, settings.policy);
}

/// How this job's object is held.
void read_mounting(JsonObject& json, JobSettings& settings) {
  if (json.has("fixture"))
    json.object("fixture", [&](JsonObject& fixture) {
      settings.fixture.post_height_mm = fixture.optional_number("post_height_mm", {0, 1000});
      settings.fixture.post_radius_mm = fixture.optional_number("post_radius_mm", {0.1, 1000});
      settings.fixture.plate_radius_mm = fixture.optional_number("plate_radius_mm", {0.1, 2000});
    });
  if (json.has("mounting"))
    json.object("mounting", [&](JsonObject& mounting) {
      if (mounting.has("offset_mm")) {
        const std::vector<double> offset = mounting.numbers("offset_mm", 3, 3, {-1000, 1000});
        if (offset[2] < 0) mounting.refuse("offset_mm", "the object would stand below the post's top");
        std::copy(offset.begin(), offset.end(), settings.mounting.offset_mm.begin());
      }
      settings.mounting.turn_deg = mounting.optional_number("turn_deg", {-360, 360}).value_or(0);
    });
}

/// How dots are placed, and what improves them afterwards.
void read_sampling(JsonObject& json, JobSettings& settings) {
  read_choice(json, "sampler", kSamplerNames, settings.sampler);
  read_choice(json, "curve", kCurveNames, settings.curve);
  read_choice(json, "density", kDensityNames, settings.density);
  settings.seed = json.optional_integer("seed", 0, UINT64_MAX).value_or(settings.seed);
  const auto small = [&json](const char* key, std::uint64_t min, std::uint64_t max, int otherwise) {
    const auto number = json.optional_integer(key, min, max);
    return number ? static_cast<int>(*number) : otherwise;
  };
  settings.levels = small("levels", 1, kLevelsMax, settings.levels);
  settings.predictive_rounds = small("predictive_rounds", 0, 4, settings.predictive_rounds);
  settings.largest_gap_pitches = json.optional_number("largest_gap_pitches", {.7, 100});
  settings.fine_passes = small("fine_passes", 1, 1000, settings.fine_passes);
  read_choice(json, "tone_curve", kToneMappingNames, settings.tone_curve);
  if (settings.largest_gap_pitches && settings.dots)
    json.refuse("largest_gap_pitches", "contradicts dots: filling holes adds to their number");
  if (settings.curve != CurveKind::kLaminar) return;
  if (settings.sampler != Sampler::kCentroid)
    json.refuse("sampler", "laminar slices have only one way to place dots: leave sampler out");
  if (settings.largest_gap_pitches)
    json.refuse("largest_gap_pitches", "laminar slices have no strata to fill");
}

JobSettings read_settings(JsonObject& json) {
  JobSettings settings;
  read_amounts(json, settings);
  if (const auto up = json.optional_choice("up", kUpNames)) settings.up = kUpNames[*up];
  read_choice(json, "untextured", kUntexturedNames, settings.untextured);
  read_sampling(json, settings);
  read_incidence(json, settings);
  read_planning(json, settings);
  read_mounting(json, settings);
  settings.cell = json.optional_text("cell", 4096).value_or(settings.cell);
  settings.dry_run = json.optional_boolean("dry_run").value_or(settings.dry_run);
  return settings;
}

template <class T>
nlohmann::ordered_json or_null(const std::optional<T>& value) {
  return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json();
}

}  // namespace

JobSettings job_settings_from_json(const std::string& text, const std::string& origin) {
  JobSettings settings;
  read_json_object(text, origin, [&](JsonObject& json) { settings = read_settings(json); },
                   {.bytes = kSettingsBytesMax, .depth = 4});
  return settings;
}

std::string job_settings_to_json(const JobSettings& settings) {
  // The default dpi is written out, so that equal jobs have equal text.
  const std::optional<double> dpi =
      settings.dpi || settings.dots ? settings.dpi : std::optional<double>(kDefaultDpi);
  const nlohmann::ordered_json json{
      {"dpi", or_null(dpi)},
      {"dots", or_null(settings.dots)},
      {"size_mm", or_null(settings.size_mm)},
      {"units_mm", or_null(settings.units_mm)},
      {"up", or_null(settings.up)},
      {"untextured", untextured_name(settings.untextured)},
      {"sampler", sampler_name(settings.sampler)},
      {"curve", curve_name(settings.curve)},
      {"density", density_name(settings.density)},
      {"seed", settings.seed},
      {"levels", settings.levels},
      {"predictive_rounds", settings.predictive_rounds},
      {"largest_gap_pitches", or_null(settings.largest_gap_pitches)},
      {"fine_passes", settings.fine_passes},
      {"tone_curve", tone_mapping_name(settings.tone_curve)},
      {"max_incidence_deg", settings.max_incidence_deg},
      {"preferred_incidence_deg", settings.preferred_incidence_deg},
      {"planning", planning_name(settings.planning)},
      {"order", order_name(settings.order)},
      {"policy", policy_name(settings.policy)},
      {"fixture",
       {{"post_height_mm", or_null(settings.fixture.post_height_mm)},
        {"post_radius_mm", or_null(settings.fixture.post_radius_mm)},
        {"plate_radius_mm", or_null(settings.fixture.plate_radius_mm)}}},
      {"mounting", {{"offset_mm", settings.mounting.offset_mm}, {"turn_deg", settings.mounting.turn_deg}}},
      {"cell", settings.cell},
      {"dry_run", settings.dry_run}};
  return json.dump();
}

std::string job_settings_sha256(JobSettings settings) {
  settings.cell = "-";
  settings.dry_run = false;
  return sha256_hex(job_settings_to_json(settings));
}

SampleOptions sample_options(const JobSettings& settings) {
  SampleOptions options;
  options.dot_count = settings.dots;
  if (!settings.dots) options.pitch_m = kMetersPerInch / settings.dpi.value_or(kDefaultDpi);
  options.sampler = settings.sampler;
  options.seed = settings.seed;
  options.dot_limit = kDotsMax;
  return options;
}

PlanOptions plan_options(const JobSettings& settings) {
  return {.max_incidence = settings.max_incidence_deg * kDegree,
          .preferred_incidence = settings.preferred_incidence_deg * kDegree,
          .planning = settings.planning,
          .order = settings.order,
          .policy = settings.policy};
}

MountingOptions mounting_options(const JobSettings& settings) {
  const auto meters = [](const std::optional<double>& length_mm) {
    return length_mm ? std::optional<double>(*length_mm * 1e-3) : std::nullopt;
  };
  const auto& offset_mm = settings.mounting.offset_mm;
  return {.post_height_m = meters(settings.fixture.post_height_mm),
          .post_radius_m = meters(settings.fixture.post_radius_mm),
          .plate_radius_m = meters(settings.fixture.plate_radius_mm),
          .offset_m = {offset_mm[0] * 1e-3, offset_mm[1] * 1e-3, offset_mm[2] * 1e-3},
          .turn = settings.mounting.turn_deg * kDegree};
}

}  // namespace hilbrush
