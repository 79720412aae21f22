#include "config/cell_file.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <sstream>
#include <system_error>

#include "config/cell_devices.h"
#include "config/config_folders.h"
#include "config/json_reader.h"
#include "sampling/base/sha256.h"

namespace hilbrush {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kCellBytesMax = 1u << 20;
constexpr std::size_t kToneCurvesMax = 256;
constexpr std::size_t kTonePointsMax = 1001;

AxisDescription read_axis(JsonObject& json, std::size_t axis) {
  const bool is_linear = axis == kJ3;
  const std::string unit = is_linear ? "_mm" : "_deg";
  // The rotary table may turn many times, a joint of the arm about once.
  const double travel = is_linear ? 2000 : axis == kRotation ? 36000 : 720;
  const double speed = is_linear ? 10000 : 20000;
  AxisDescription description;
  description.min = json.quantity("min" + unit, {-travel, travel});
  description.max = json.quantity("max" + unit, {-travel, travel});
  description.speed_max = json.quantity("speed_max" + unit + "_s", {0.1, speed});
  description.acceleration_max = json.quantity("acceleration_max" + unit + "_s2", {1, 1e6});
  description.settle_saturation = json.quantity("settle_saturation" + unit, {0.001, travel});
  description.home = json.quantity("home" + unit, {-travel, travel});
  if (description.min >= description.max) json.refuse("max" + unit, "not above min" + unit);
  if (description.home < description.min || description.home > description.max)
    json.refuse("home" + unit, "outside min" + unit + " to max" + unit);
  return description;
}

void read_arm(JsonObject& json, CellDescription::Arm& arm) {
  arm.upper_arm_m = json.quantity("upper_arm_mm", {10, 5000});
  arm.forearm_m = json.quantity("forearm_mm", {10, 5000});
  arm.beam_depression = json.quantity("beam_depression_deg", {0, 90});
  arm.flange_to_focus_m = json.quantity("flange_to_focus_mm", {1, 2000});
  arm.quill_radius_m = json.quantity("quill_radius_mm", {0, 500});
}

/// The column ends below the upper arm unless the file gives its height.
void read_column(JsonObject& json, CellDescription::Arm& arm) {
  if (!json.has("column_radius_mm")) {
    if (json.has("column_height_mm")) json.refuse("column_height_mm", "needs column_radius_mm too");
    return;
  }
  arm.column.radius_m = json.quantity("column_radius_mm", {0, 2000});
  arm.column.height_m = json.has("column_height_mm")
                            ? json.quantity("column_height_mm", {0, 5000})
                            : std::max(0., arm.upper_link.height_m - arm.upper_link.radius_m);
}

/// The links run above the highest position of the lens unless the file gives their height; the quill ends in
/// the forearm.
void read_links(JsonObject& json, const AxisDescription& j3, const CellDescription::Lens& lens,
                CellDescription::Arm& arm) {
  constexpr double kRadiusM = .035;
  constexpr double kGapM = .03;
  const auto or_else = [&json](const char* key, JsonRange range, double otherwise) {
    return json.has(key) ? json.quantity(key, range) : otherwise;
  };
  const double lens_top_m = (lens.far_m - arm.flange_to_focus_m) * std::sin(arm.beam_depression) +
                            lens.radius_m * std::cos(arm.beam_depression);
  arm.fore_link.radius_m = or_else("forearm_radius_mm", {0, 1000}, kRadiusM);
  arm.fore_link.height_m = or_else("forearm_height_mm", {-5000, 5000},
                                   j3.max + std::max(lens_top_m, 0.) + kGapM + arm.fore_link.radius_m);
  arm.upper_link.radius_m = or_else("upper_arm_radius_mm", {0, 1000}, arm.fore_link.radius_m);
  arm.upper_link.height_m = or_else("upper_arm_height_mm", {-5000, 5000}, arm.fore_link.height_m);
  arm.quill_length_m = or_else("quill_length_mm", {0, 5000}, std::max(arm.fore_link.height_m - j3.min, .001));
}

void read_lens(JsonObject& json, CellDescription::Lens& lens) {
  lens.radius_m = json.quantity("radius_mm", {0.1, 500});
  lens.near_m = json.quantity("near_mm", {0.1, 2000});
  lens.far_m = json.quantity("far_mm", {0.1, 5000});
  if (lens.near_m >= lens.far_m) json.refuse("far_mm", "not above near_mm");
}

void read_table(JsonObject& json, CellDescription::Table& table) {
  const std::vector<double> axis = json.quantities("tilt_axis_mm", 3, {-5000, 5000});
  table.tilt_axis_W = {axis[0], axis[1], axis[2]};
  table.plate_height_m = json.quantity("plate_height_mm", {-2000, 2000});
  table.plate_radius_m = json.quantity("plate_radius_mm", {0.1, 2000});
  table.plate_thickness_m = json.quantity("plate_thickness_mm", {0.1, 1000});
}

void read_fixture(JsonObject& json, CellDescription::Fixture& fixture) {
  fixture.post_height_m = json.quantity("post_height_mm", {0, 1000});
  fixture.post_radius_m = json.quantity("post_radius_mm", {0.1, 1000});
}

void read_laser(JsonObject& json, CellDescription::Laser& laser) {
  laser.power_min_w = json.quantity("power_min_mw", {0, 100000});
  laser.power_max_w = json.quantity("power_max_mw", {0.001, 100000});
  laser.pulse_min_s = json.quantity("pulse_min_ms", {0.001, 10000});
  laser.pulse_max_s = json.quantity("pulse_max_ms", {0.001, 10000});
  laser.pulse_s = json.quantity("pulse_ms", {0.001, 10000});
  if (laser.power_min_w >= laser.power_max_w) json.refuse("power_max_mw", "not above power_min_mw");
  if (laser.pulse_min_s > laser.pulse_max_s) json.refuse("pulse_max_ms", "below pulse_min_ms");
  if (laser.pulse_s < laser.pulse_min_s || laser.pulse_s > laser.pulse_max_s)
    json.refuse("pulse_ms", "outside pulse_min_ms to pulse_max_ms");

  const bool has_diameter = json.has("spot_diameter_mm");
  if (has_diameter && json.has("spot_pitches"))
    json.refuse("spot_pitches", "contradicts spot_diameter_mm: give one of the two");
  if (has_diameter)
    laser.spot_diameter_m = json.quantity("spot_diameter_mm", {0.001, 100});
  else
    laser.spot_pitches = json.number("spot_pitches", {0.2, 10});
}

ToneCurveEntry read_tone_curve(JsonObject& json, double asked_max) {
  ToneCurveEntry entry;
  entry.sampler = json.text("sampler", 40);
  entry.curve = json.optional_text("curve", 40).value_or(entry.curve);
  entry.levels = static_cast<int>(json.optional_integer("levels", 1, 4).value_or(1));
  entry.spot_pitches = json.optional_number("spot_pitches", {0.2, 100});
  entry.wanted = json.numbers("wanted", 2, kTonePointsMax, {0, 1});
  entry.asked = json.numbers("asked", entry.wanted.size(), entry.wanted.size(), {0, asked_max});
  if (entry.wanted.front() != 0 || entry.wanted.back() != 1) json.refuse("wanted", "does not go from 0 to 1");
  if (std::adjacent_find(entry.wanted.begin(), entry.wanted.end(), std::greater_equal<>()) !=
      entry.wanted.end())
    json.refuse("wanted", "must increase from each number to the next");
  if (!std::is_sorted(entry.asked.begin(), entry.asked.end())) json.refuse("asked", "must not decrease");
  return entry;
}

void read_paint(JsonObject& json, CellDescription::Paint& paint) {
  constexpr std::array kResponses{PaintResponse::kLinear, PaintResponse::kSaturating,
                                  PaintResponse::kSigmoid};
  paint.response = kResponses[json.choice("response", {"linear", "saturating", "sigmoid"})];
  paint.reflectance_white = json.number("reflectance_white", {0.01, 1});
  paint.reflectance_black = json.number("reflectance_black", {0, 1});
  if (paint.reflectance_black >= paint.reflectance_white)
    json.refuse("reflectance_black", "not below reflectance_white");
  paint.dose_full_j_m2 = json.quantity("dose_full_j_m2", {1e-3, 1e9});
  paint.asked_max = json.number("asked_max", {0.1, 10});
  json.objects("tone_curves", kToneCurvesMax, [&](JsonObject& curve) {
    ToneCurveEntry entry = read_tone_curve(curve, paint.asked_max);
    for (const ToneCurveEntry& other : paint.tone_curves)
      if (other.sampler == entry.sampler && other.curve == entry.curve && other.levels == entry.levels &&
          other.spot_pitches == entry.spot_pitches)
        curve.refuse("sampler", "\"" + entry.sampler + "\" has a curve already");
    paint.tone_curves.push_back(std::move(entry));
  });
}

void read_timing(JsonObject& json, CellDescription::Timing& timing) {
  timing.tick_s = json.quantity("tick_ms", {0.1, 100});
  timing.settle_min_s = json.quantity("settle_min_ms", {0, 10000});
  timing.settle_max_s = json.quantity("settle_max_ms", {0, 10000});
  timing.retract_s = json.quantity("retract_ms", {0, 60000});
  timing.message_s = json.quantity("message_ms", {0, 10000});
  if (timing.settle_min_s > timing.settle_max_s) json.refuse("settle_max_ms", "below settle_min_ms");
}

/// A cell file that does not say how its controllers lead their joints gets moves that are clear in any case.
void read_interpolation(JsonObject& json, CellDescription::Motion& motion) {
  constexpr std::array kInterpolations{Interpolation::kUnknown, Interpolation::kIndependent,
                                       Interpolation::kCoordinated};
  const auto read = [&](const char* chain, Interpolation& interpolation) {
    if (json.has(chain))
      interpolation = kInterpolations[json.choice(chain, {"unknown", "independent", "coordinated"})];
  };
  read("robot", motion.robot);
  read("table", motion.table);
  if (json.has("start_lag_ms")) motion.start_lag_s = json.quantity("start_lag_ms", {0, 200});
}

/// Reads what jobs report in `timing.measured`.
void read_measured(JsonObject& json, CellDescription& cell) {
  if (json.has("move_delay_ms")) cell.timing.move_delay_s = json.quantity("move_delay_ms", {0, 10000});
  if (!json.has("time_factor")) return;
  json.object("time_factor", [&](JsonObject& factors) {
    for (std::size_t i = 0; i < kAxisCount; ++i)
      cell.axes[i].time_factor = factors.optional_number(kAxisNames[i], {.2, 10}).value_or(1);
  });
}

CellDescription read_cell(JsonObject& json, const fs::path& folder, CellDeviceOptions& device_options) {
  CellDescription cell;
  cell.name = json.text("name", 100);
  json.object("axes", [&](JsonObject& axes) {
    for (std::size_t i = 0; i < kAxisCount; ++i)
      axes.object(kAxisNames[i], [&](JsonObject& axis) { cell.axes[i] = read_axis(axis, i); });
  });
  cell.limit_margin = json.number("limit_margin", {0, 0.4});
  json.object("lens", [&](JsonObject& lens) { read_lens(lens, cell.lens); });
  json.object("arm", [&](JsonObject& arm) {
    read_arm(arm, cell.arm);
    read_links(arm, cell.axes[kJ3], cell.lens, cell.arm);
    read_column(arm, cell.arm);
  });
  json.object("table", [&](JsonObject& table) { read_table(table, cell.table); });
  json.object("fixture", [&](JsonObject& fixture) { read_fixture(fixture, cell.fixture); });
  json.object("laser", [&](JsonObject& laser) { read_laser(laser, cell.laser); });
  json.object("paint", [&](JsonObject& paint) { read_paint(paint, cell.paint); });
  json.object("timing", [&](JsonObject& timing) { read_timing(timing, cell.timing); });
  if (json.has("interpolation"))
    json.object("interpolation", [&](JsonObject& motion) { read_interpolation(motion, cell.motion); });
  if (json.has("measured"))
    json.object("measured", [&](JsonObject& measured) { read_measured(measured, cell); });
  json.object("devices",
              [&](JsonObject& devices) { device_options = read_cell_devices(devices, cell, folder); });
  json.object("simulation", [&](JsonObject& simulation) {
    cell.simulation.time_scale = simulation.number("time_scale", {0, 1000});
  });
  return cell;
}

/// The folder with the shipped cells. It comes from the environment because no settings are read yet when a
/// cell is looked for.
fs::path cells_folder() {
  if (const char* folder = std::getenv("HILBRUSH_CELLS"); folder != nullptr && *folder != '\0') return folder;
  return shipped_folder("cells");
}

struct CellFile {
  CellDescription cell;
  CellDeviceOptions devices;
};

CellFile read_cell_file(const std::string& text, const std::string& origin) {
  CellFile file;
  const fs::path folder = fs::path(origin).parent_path();
  read_json_object(text, origin, [&](JsonObject& json) { file.cell = read_cell(json, folder, file.devices); },
                   {.bytes = kCellBytesMax});
  file.cell.sha256 = sha256_hex(text);
  return file;
}

}  // namespace

CellDescription cell_from_json(const std::string& text, const std::string& origin) {
  return read_cell_file(text, origin).cell;
}

CellDeviceOptions cell_devices_from_json(const std::string& text, const std::string& origin) {
  return read_cell_file(text, origin).devices;
}

CellDeviceOptions load_cell_devices(const fs::path& file) {
  return cell_devices_from_json(read_text_file(file.string(), kCellBytesMax), file.string());
}

CellDescription load_cell(const fs::path& file) {
  return cell_from_json(read_text_file(file.string(), kCellBytesMax), file.string());
}

std::vector<std::string> cell_warnings(const CellDescription& cell) {
  std::vector<std::string> warnings;
  const auto warn = [&](const char* at, const std::string& sentence) {
    warnings.push_back(std::string(at) + ": " + sentence);
  };
  const auto text = [](double value) {
    std::ostringstream out;
    out << value;
    return out.str();
  };
  // Measured on simulated film: at 1.0 pitches dark areas stay unfilled, at 2.0 detail is lost in saturated
  // paint; 1.41 is best.
  const double pitches = cell.laser.spot_pitches;
  if (!cell.laser.spot_diameter_m && (pitches < 1.2 || pitches > 1.8))
    warn("$.laser.spot_pitches",
         text(pitches) + " is outside 1.2 to 1.8: dark areas stay unfilled below, detail is lost above");
  if (cell.lens.near_m < cell.lens.radius_m)
    warn("$.lens.near_mm",
         "the lens comes closer to the focus than its own radius: most oblique beams will collide");
  if (cell.lens.far_m < cell.arm.flange_to_focus_m)
    warn("$.lens.far_mm", "the lens body ends before it reaches the flange");
  const auto& fore = cell.arm.fore_link;
  if (fore.radius_m > 0 && cell.axes[kJ3].max > fore.height_m - fore.radius_m)
    warn("$.arm.forearm_height_mm", "the flange would run into the forearm at the top of J3");
  if (cell.paint.tone_curves.empty())
    warn("$.paint.tone_curves", "none: pictures lose 14 to 18 dB without one; `hilbrush calibrate` makes it");
  const double reach = cell.arm.upper_arm_m + cell.arm.forearm_m +
                       cell.arm.flange_to_focus_m * std::cos(cell.arm.beam_depression);
  if (cell.table.tilt_axis_W.head<2>().norm() > reach)
    warn("$.table.tilt_axis_mm", "farther from J1 than the arm reaches");
  if (cell.arm.column.radius_m + cell.table.plate_radius_m > cell.table.tilt_axis_W.head<2>().norm())
    warn("$.arm.column_radius_mm", "the table's plate would stand in the robot's column");
  return warnings;
}

std::vector<std::string> known_cells() {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator entry(cells_folder(), error), end; !error && entry != end;
       entry.increment(error))
    if (entry->path().extension() == ".json") names.push_back(entry->path().stem().string());
  std::sort(names.begin(), names.end());
  return names;
}

fs::path find_cell(const std::string& name) {
  std::error_code error;
  if (name.find('/') != std::string::npos || name.ends_with(".json")) {
    if (!fs::is_regular_file(name, error)) throw InputError(name, "no such cell file");
    return name;
  }
  fs::path file = cells_folder() / (name + ".json");
  if (name.empty() || !fs::is_regular_file(file, error)) {
    std::string known;
    for (const std::string& cell : known_cells()) known += (known.empty() ? "" : ", ") + cell;
    throw InputError("cell", "no cell is called \"" + name + "\" in " + cells_folder().string() +
                                 "; known: " + (known.empty() ? "none" : known));
  }
  return file;
}

namespace {

/// The curve for this placement with the nearest spot; null if there is none.
const ToneCurveEntry* find_tone_curve(const CellDescription::Paint& paint, const ToneCurveUse& use) {
  const ToneCurveEntry* best = nullptr;
  double best_off = 0;
  for (const ToneCurveEntry& entry : paint.tone_curves) {
    if (entry.sampler != use.sampler || entry.curve != use.curve || entry.levels != use.levels) continue;
    const double off =
        entry.spot_pitches && use.spot_pitches ? std::abs(*entry.spot_pitches - *use.spot_pitches) : 0;
    if (best != nullptr && off >= best_off) continue;
    best = &entry;
    best_off = off;
  }
  return best;
}

std::string describe(const ToneCurveUse& use) {
  std::string text = "sampler \"" + use.sampler + "\"";
  if (use.curve != "hilbert") text += " on curve \"" + use.curve + "\"";
  if (use.levels != 1) text += " with " + std::to_string(use.levels) + " levels";
  return text;
}

/// The curve of the same sampler and levels on the other space-filling curve, or null. Laminar slices are no
/// such curve.
const ToneCurveEntry* find_similar_tone_curve(const CellDescription::Paint& paint, ToneCurveUse use) {
  if (use.curve == "laminar") return nullptr;
  for (const char* curve : {"hilbert", "peano2"}) {
    use.curve = curve;
    if (const ToneCurveEntry* found = find_tone_curve(paint, use)) return found;
  }
  return nullptr;
}

constexpr double kSpotTolerance = .1;  ///< as a share; below this the error of the tones is not measurable

bool is_for_another_spot(const ToneCurveEntry& entry, const ToneCurveUse& use) {
  return entry.spot_pitches && use.spot_pitches &&
         std::abs(*entry.spot_pitches / *use.spot_pitches - 1) > kSpotTolerance;
}

std::string missing_curve_warning(const ToneCurveUse& use, const ToneCurveEntry* similar) {
  return "the cell file has no tone curve for " + describe(use) +
         (similar == nullptr ? ": tones will be off" : ", that on curve \"" + similar->curve + "\" is used") +
         "; `hilbrush calibrate` makes one";
}

std::string other_spot_warning(const ToneCurveUse& use, const ToneCurveEntry& entry) {
  std::ostringstream text;
  text << "the tone curve for " << describe(use) << " was made for a spot of " << *entry.spot_pitches
       << " pitches, and at this pitch it has " << *use.spot_pitches
       << ": tones will be off; `hilbrush calibrate --dpi` makes one";
  return text.str();
}

}  // namespace

CellTone cell_tone(const CellDescription& cell, const ToneCurveUse& use) {
  CellTone tone;
  tone.options.reflectance_white = cell.paint.reflectance_white;
  tone.options.reflectance_black = cell.paint.reflectance_black;
  const ToneCurveEntry* found = find_tone_curve(cell.paint, use);
  if (found == nullptr) {
    found = find_similar_tone_curve(cell.paint, use);
    tone.warning = missing_curve_warning(use, found);
  } else if (is_for_another_spot(*found, use)) {
    tone.warning = other_spot_warning(use, *found);
  }
  if (found != nullptr) tone.options.curve = {found->wanted, found->asked};
  return tone;
}

}  // namespace hilbrush
