#include "daemon/commands/settings_flags.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <type_traits>

#include "config/json_reader.h"
#include "daemon/commands/number_checks.h"
#include "sampling/base/text.h"

namespace hilbrush {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kSettingsBytesMax = 64u << 10;

/// "$.size_mm" -> "--size-mm", "$.mounting.offset_mm[2]" -> "--offset-mm".
std::string flag_of_path(const std::string& path) {
  if (!path.starts_with("$.")) return path;
  const std::string key = path.substr(path.rfind('.') + 1);
  std::string flag = "--" + key.substr(0, key.find('['));
  std::replace(flag.begin(), flag.end(), '_', '-');
  return flag;
}

/// JSON has no nan and no infinity: they would become null, which means "not given".
template <class T>
void refuse_not_finite(const char* key, const T& value) {
  if constexpr (std::is_same_v<T, double>) {
    if (!std::isfinite(value))
      throw InputError(std::string("$.") + key, "expected a number, found " + number(value));
  } else if constexpr (std::is_same_v<T, std::vector<double>>) {
    for (const double each : value) refuse_not_finite(key, each);
  }
}

template <class T>
void put(Json& json, const char* key, const std::optional<T>& value) {
  if (!value) return;
  refuse_not_finite(key, *value);
  json[key] = *value;
}

/// Sets one key of an object inside the settings.
template <class T>
void put_inside(Json& json, const char* object, const char* key, const std::optional<T>& value) {
  if (!value) return;
  refuse_not_finite(key, *value);
  if (!json.contains(object) || json[object].is_null()) json[object] = Json::object();
  json[object][key] = *value;
}

/// Of two flags that exclude each other: one that is given replaces the value of the other in the file.
template <class T, class U>
void put_pair(Json& json, const char* key, const std::optional<T>& value, const char* other_key,
              const std::optional<U>& other) {
  if (value && !other) json.erase(other_key);
  put(json, key, value);
}

bool is_path(const std::string& cell) {
  return cell.find('/') != std::string::npos || cell.ends_with(".json");
}

constexpr const char* kGroup = "Settings of the job";
constexpr const char* kDpiHelp = "dots per inch where the tone is full, 10 to 1200 (default 100)";

void add_size_flags(SettingsFlags& flags, CLI::App& command) {
  command.add_option("--dpi", flags.dpi, kDpiHelp)->group(kGroup);
  command.add_option("--dots", flags.dots, "instead of --dpi: the exact number of dots")
      ->check(not_negative())
      ->group(kGroup);
  command.add_option("--size-mm", flags.size_mm, "scale the longest side of the model to this")
      ->group(kGroup);
  command.add_option("--units-mm", flags.units_mm, "instead of --size-mm: millimeters per unit of the file")
      ->group(kGroup);
  command
      .add_option("--up", flags.up,
                  "the axis of the model that points up, y or z (default: that of the file format)")
      ->group(kGroup);
}

void add_tone_flags(SettingsFlags& flags, CLI::App& command) {
  command
      .add_option("--untextured", flags.untextured,
                  "parts without texture or colors: auto (default), blank or material")
      ->group(kGroup);
  command
      .add_option("--density", flags.density,
                  "what the density of dots follows: texture (default), mean_curvature or gaussian_curvature")
      ->group(kGroup);
  command
      .add_option("--predictive-rounds", flags.predictive_rounds,
                  "predict the picture and place the dots again, 0 to 4 times (default 0; 2 are enough)")
      ->check(not_negative())
      ->group(kGroup);
  command
      .add_option("--largest-gap-pitches", flags.largest_gap_pitches,
                  "fill holes between dots that are wider than this many pitches, 0.7 to 100 (default: none)")
      ->group(kGroup);
  command
      .add_option("--tone-curve", flags.tone_curve,
                  "calibrated (default), or linear: asked = wanted times asked_max, to paint a wedge")
      ->group(kGroup);
}

void add_planning_flags(SettingsFlags& flags, CLI::App& command) {
  command
      .add_option("--max-incidence-deg", flags.max_incidence_deg,
                  "largest angle between beam and surface normal, 1 to 45 (default 45)")
      ->group(kGroup);
  command
      .add_option("--preferred-incidence-deg", flags.preferred_incidence_deg,
                  "exceeded only where a dot cannot be reached within it (default 20)")
      ->group(kGroup);
  command
      .add_option("--planning", flags.planning,
                  "quality (beams nearest to the surface normals), balanced (default) or fast")
      ->group(kGroup);
  command.add_option("--order", flags.order, "of the dots: improved (default), or curve: as along the curve")
      ->group(kGroup);
  command
      .add_option("--policy", flags.policy,
                  "search (default), or follow_normal: turn the table for every dot, for comparison")
      ->group(kGroup);
}

void add_mounting_flags(SettingsFlags& flags, CLI::App& command) {
  command
      .add_option("--post-height-mm", flags.post_height_mm,
                  "of the post under the object, 0 to 1000 (default: the cell's)")
      ->group(kGroup);
  command.add_option("--post-radius-mm", flags.post_radius_mm, "of the post (default: the cell's)")
      ->group(kGroup);
  command
      .add_option("--plate-radius-mm", flags.plate_radius_mm, "of the table's plate (default: the cell's)")
      ->group(kGroup);
  command
      .add_option(
          "--offset-mm", flags.offset_mm,
          "x,y,z of the object from the center of the post's top (default 0,0,0: centered, standing on it)")
      ->delimiter(',')
      ->expected(3)
      ->group(kGroup);
  command
      .add_option("--turn-deg", flags.turn_deg,
                  "turn of the object about the post, before the offset (default 0)")
      ->group(kGroup);
}

void put_sampling(const SettingsFlags& flags, Json& json) {
  put_pair(json, "dpi", flags.dpi, "dots", flags.dots);
  put_pair(json, "dots", flags.dots, "dpi", flags.dpi);
  put_pair(json, "size_mm", flags.size_mm, "units_mm", flags.units_mm);
  put_pair(json, "units_mm", flags.units_mm, "size_mm", flags.size_mm);
  put(json, "up", flags.up);
  put(json, "untextured", flags.untextured);
  put(json, "sampler", flags.sampler);
  put(json, "curve", flags.curve);
  put(json, "density", flags.density);
  put(json, "levels", flags.levels);
  put(json, "predictive_rounds", flags.predictive_rounds);
  put(json, "largest_gap_pitches", flags.largest_gap_pitches);
  put(json, "fine_passes", flags.fine_passes);
  put(json, "tone_curve", flags.tone_curve);
  put(json, "seed", flags.seed);
}

void put_planning(const SettingsFlags& flags, Json& json) {
  put(json, "max_incidence_deg", flags.max_incidence_deg);
  put(json, "preferred_incidence_deg", flags.preferred_incidence_deg);
  put(json, "planning", flags.planning);
  put(json, "order", flags.order);
  put(json, "policy", flags.policy);
  put(json, "cell", flags.cell);
  put_inside(json, "fixture", "post_height_mm", flags.post_height_mm);
  put_inside(json, "fixture", "post_radius_mm", flags.post_radius_mm);
  put_inside(json, "fixture", "plate_radius_mm", flags.plate_radius_mm);
  put_inside(json, "mounting", "turn_deg", flags.turn_deg);
  if (!flags.offset_mm.empty()) put_inside(json, "mounting", "offset_mm", std::optional(flags.offset_mm));
}

}  // namespace

void SettingsFlags::add_to(CLI::App& command) {
  add_size_flags(*this, command);
  add_tone_flags(*this, command);
  add_planning_flags(*this, command);
  add_mounting_flags(*this, command);
  add_paint_flags_to(command);
}

void SettingsFlags::add_paint_flags_to(CLI::App& command) {
  command
      .add_option(
          "--sampler", sampler,
          "centroid (default), jittered, even, random, halton, hammersley, sobol, niederreiter, blue or fine")
      ->group(kGroup);
  command.add_option("--curve", curve, "hilbert (default), peano2 or laminar")->group(kGroup);
  command.add_option("--levels", levels, "number of energies that a dot may have, 1 to 4 (default 1)")
      ->check(not_negative())
      ->group(kGroup);
  command
      .add_option("--fine-passes", fine_passes,
                  "of the sampler fine, each over all dots, 1 to 1000 (default 24)")
      ->check(not_negative())
      ->group(kGroup);
  command.add_option("--seed", seed, "of the random numbers (default 1)")
      ->check(not_negative())
      ->group(kGroup);
  command.add_option("--cell", cell, "name of a cell, or its file (default: default)")->group(kGroup);
  command.add_option("--settings", file, "JSON file with any of these settings; flags override it")
      ->group(kGroup);
  if (command.get_option_no_throw("--dpi") == nullptr)
    command.add_option("--dpi", dpi, kDpiHelp)->group(kGroup);
}

bool SettingsFlags::any() const {
  return !file.empty() || dpi || size_mm || units_mm || max_incidence_deg || preferred_incidence_deg ||
         dots || seed || up || untextured || sampler || curve || density || levels || predictive_rounds ||
         largest_gap_pitches || fine_passes || tone_curve || planning || order || policy || cell ||
         post_height_mm || post_radius_mm || plate_radius_mm || turn_deg || !offset_mm.empty();
}

std::string SettingsFlags::to_json(const std::string& base, const std::string& base_origin) const {
  Json json = Json::object();
  const std::string text = file.empty() ? base : read_text_file(file, kSettingsBytesMax);
  if (!file.empty() || !text.empty()) {
    job_settings_from_json(text, file.empty() ? base_origin : file);
    json = Json::parse(text);
  }
  try {
    put_sampling(*this, json);
    put_planning(*this, json);
    const JobSettings settings = job_settings_from_json(json.dump());
    if (json.contains("cell") && is_path(settings.cell))
      json["cell"] = std::filesystem::absolute(settings.cell).lexically_normal();
  } catch (const InputError& error) {
    throw InputError(flag_of_path(error.at()), error.sentence());
  } catch (const Json::type_error&) {
    throw InputError("flags", "a value is not UTF-8 text");
  }
  return json.dump();
}

}  // namespace hilbrush
