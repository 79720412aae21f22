#include "daemon/commands/settings_flags.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "config/json_reader.h"

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

template <class T>
void put(Json& json, const char* key, const std::optional<T>& value) {
  if (value) json[key] = *value;
}

/// One key of an object of the settings.
template <class T>
void put_inside(Json& json, const char* object, const char* key, const std::optional<T>& value) {
  if (!value) return;
  if (!json.contains(object) || json[object].is_null()) json[object] = Json::object();
  json[object][key] = *value;
}

/// A flag and its rival of which a job has one: the flag replaces what the file says.
template <class T, class U>
void put_pair(Json& json, const char* key, const std::optional<T>& value, const char* rival,
              const std::optional<U>& other) {
  if (value && !other) json.erase(rival);
  put(json, key, value);
}

bool is_path(const std::string& cell) {
  return cell.find('/') != std::string::npos || cell.ends_with(".json");
}

}  // namespace

void SettingsFlags::add_to(CLI::App& command) {
  const std::string group = "Settings of the job";
  command.add_option("--dpi", dpi, "dots per inch of full tone, 10 to 1200 (default 100)")->group(group);
  command.add_option("--dots", dots, "or: exactly so many dots")->group(group);
  command.add_option("--size-mm", size_mm, "scale the model's longest side to this")->group(group);
  command.add_option("--units-mm", units_mm, "or: millimeters of one unit of the file")->group(group);
  command.add_option("--up", up, "the model's upward axis, y or z (default: the format's habit)")->group(group);
  command.add_option("--untextured", untextured, "parts without texture or colors: auto, blank or material")
      ->group(group);
  command.add_option("--density", density, "what asks for dots: texture, mean_curvature or gaussian_curvature")
      ->group(group);
  command
      .add_option("--predictive-rounds", predictive_rounds,
                  "predict the picture and place the dots again, 0 to 4 times (default 0; 2 is plenty)")
      ->group(group);
  command
      .add_option("--largest-gap-pitches", largest_gap_pitches,
                  "fill holes between dots that are wider than this many pitches, 0.7 to 100 (default: none)")
      ->group(group);
  command
      .add_option("--tone-curve", tone_curve,
                  "calibrated (default), or linear: asked = wanted times asked_max, to paint a wedge")
      ->group(group);
  command.add_option("--max-incidence-deg", max_incidence_deg, "never more oblique than this, 1 to 45 (default 45)")
      ->group(group);
  command
      .add_option("--preferred-incidence-deg", preferred_incidence_deg,
                  "exceeded only where a dot can't be met within it (default 20)")
      ->group(group);
  command.add_option("--planning", planning, "quality (beams nearest the normals), balanced (default) or fast")
      ->group(group);
  command.add_option("--order", order, "of the dots: improved (default), or curve: along it as it is")->group(group);
  command
      .add_option("--policy", policy,
                  "search (default), or follow_normal: the table turned for every dot, to compare with")
      ->group(group);
  command
      .add_option("--post-height-mm", post_height_mm, "of the post under the object, 0 to 1000 (default: the cell's)")
      ->group(group);
  command.add_option("--post-radius-mm", post_radius_mm, "of the post (default: the cell's)")->group(group);
  command.add_option("--plate-radius-mm", plate_radius_mm, "of the table's plate (default: the cell's)")->group(group);
  command
      .add_option("--offset-mm", offset_mm,
                  "x,y,z of the object from the middle of the post's top (default 0,0,0: centered, standing on it)")
      ->delimiter(',')
      ->expected(3)
      ->group(group);
  command.add_option("--turn-deg", turn_deg, "the object about the post, before it is shifted (default 0)")
      ->group(group);
  add_paint_flags_to(command);
}

void SettingsFlags::add_paint_flags_to(CLI::App& command) {
  const std::string group = "Settings of the job";
  command
      .add_option("--sampler", sampler,
                  "centroid (default), jittered, even, random, halton, hammersley, sobol, niederreiter, blue or fine")
      ->group(group);
  command.add_option("--curve", curve, "hilbert (default), peano2 or laminar")->group(group);
  command.add_option("--levels", levels, "energies that a dot may have, 1 to 4 (default 1)")->group(group);
  command.add_option("--fine-passes", fine_passes, "over all dots, of the sampler fine, 1 to 1000 (default 24)")
      ->group(group);
  command.add_option("--seed", seed, "of what is random (default 1)")->group(group);
  command.add_option("--cell", cell, "name of a cell, or its file (default: default)")->group(group);
  command.add_option("--settings", file, "JSON file with any of these settings; flags override it")->group(group);
  if (command.get_option_no_throw("--dpi") == nullptr)
    command.add_option("--dpi", dpi, "dots per inch of full tone, 10 to 1200 (default 100)")->group(group);
}

bool SettingsFlags::any() const {
  return !file.empty() || dpi || size_mm || units_mm || max_incidence_deg || preferred_incidence_deg || dots || seed ||
         up || untextured || sampler || curve || density || levels || predictive_rounds || largest_gap_pitches ||
         fine_passes || tone_curve || planning || order || policy || cell || post_height_mm || post_radius_mm ||
         plate_radius_mm || turn_deg || !offset_mm.empty();
}

std::string SettingsFlags::to_json(const std::string& base, const std::string& base_origin) const {
  Json json = Json::object();
  const std::string text = file.empty() ? base : read_text_file(file, kSettingsBytesMax);
  if (!text.empty()) {
    job_settings_from_json(text, file.empty() ? base_origin : file);
    json = Json::parse(text);
  }
  put_pair(json, "dpi", dpi, "dots", dots);
  put_pair(json, "dots", dots, "dpi", dpi);
  put_pair(json, "size_mm", size_mm, "units_mm", units_mm);
  put_pair(json, "units_mm", units_mm, "size_mm", size_mm);
  put(json, "up", up);
  put(json, "untextured", untextured);
  put(json, "sampler", sampler);
  put(json, "curve", curve);
  put(json, "density", density);
  put(json, "levels", levels);
  put(json, "predictive_rounds", predictive_rounds);
  put(json, "largest_gap_pitches", largest_gap_pitches);
  put(json, "fine_passes", fine_passes);
  put(json, "tone_curve", tone_curve);
  put(json, "seed", seed);
  put(json, "max_incidence_deg", max_incidence_deg);
  put(json, "preferred_incidence_deg", preferred_incidence_deg);
  put(json, "planning", planning);
  put(json, "order", order);
  put(json, "policy", policy);
  put(json, "cell", cell);
  put_inside(json, "fixture", "post_height_mm", post_height_mm);
  put_inside(json, "fixture", "post_radius_mm", post_radius_mm);
  put_inside(json, "fixture", "plate_radius_mm", plate_radius_mm);
  put_inside(json, "mounting", "turn_deg", turn_deg);
  if (!offset_mm.empty()) put_inside(json, "mounting", "offset_mm", std::optional(offset_mm));
  try {
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
