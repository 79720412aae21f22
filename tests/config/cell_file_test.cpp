#include "config/cell_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "config/json_reader.h"
#include "sampling/base/angles.h"
#include "sampling/base/sha256.h"

namespace hilbrush {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

fs::path shipped(const std::string& name) {
  return fs::path(HILBRUSH_SOURCE_DIR) / "config" / "cells" / (name + ".json");
}

std::string default_text() {
  return read_text_file(shipped("default").string(), 1u << 20);
}

/// The error of a cell's text: at() and sentence(); empty at: accepted.
struct Refusal {
  std::string at, sentence;
};
Refusal refusal_of(const Json& json) {
  try {
    cell_from_json(json.dump(), "cell.json");
  } catch (const InputError& error) {
    return {error.at(), error.sentence()};
  }
  return {};
}

/// JSON pointers of every key in the document, objects before their members. Lists have tests of their own.
void collect_keys(const Json& json, const Json::json_pointer& at, std::vector<Json::json_pointer>& keys) {
  if (json.is_object()) {
    for (const auto& [key, value] : json.items()) {
      keys.push_back(at / key);
      collect_keys(value, at / key, keys);
    }
  }
}

std::string json_path(const Json::json_pointer& pointer) {
  std::string path = pointer.to_string();
  std::replace(path.begin(), path.end(), '/', '.');
  return "cell.json: $" + path;
}

std::vector<Json::json_pointer> default_keys() {
  const Json json = Json::parse(default_text());
  std::vector<Json::json_pointer> keys;
  collect_keys(json, Json::json_pointer(), keys);
  return keys;
}

/// Without those that may be left out, or be null: they have tests of their own.
std::vector<Json::json_pointer> required_keys() {
  std::vector<Json::json_pointer> keys = default_keys();
  std::erase_if(keys,
                [](const Json::json_pointer& key) { return key.to_string().starts_with("/arm/column_"); });
  return keys;
}

TEST(CellFile, TheDefaultCellHasTheLimitsThatPlanningWasMeasuredWith) {
  const CellDescription cell = load_cell(find_cell("default"));
  EXPECT_EQ(cell.name, "default");
  EXPECT_EQ(cell.sha256, sha256_hex(default_text()));
  EXPECT_EQ(cell.arm.upper_arm_m, .225);
  EXPECT_EQ(cell.arm.forearm_m, .175);
  EXPECT_DOUBLE_EQ(cell.arm.beam_depression, 45 * kDegree);
  EXPECT_EQ(cell.arm.flange_to_focus_m, .1);
  EXPECT_DOUBLE_EQ(cell.axes[kJ1].speed_max, 720 * kDegree);
  EXPECT_DOUBLE_EQ(cell.axes[kJ2].acceleration_max, 14000 * kDegree);
  EXPECT_EQ(cell.axes[kJ3].speed_max, 1.1);
  EXPECT_EQ(cell.axes[kJ3].acceleration_max, 18.);
  EXPECT_EQ(cell.axes[kJ3].settle_saturation, .02);
  EXPECT_DOUBLE_EQ(cell.axes[kTilt].speed_max, 120 * kDegree);
  EXPECT_DOUBLE_EQ(cell.axes[kRotation].speed_max, 270 * kDegree);
  EXPECT_EQ(cell.fixture.post_height_m, .05);
  EXPECT_EQ(cell.table.plate_radius_m, .03);
  EXPECT_EQ(cell.timing.tick_s, .004);
  EXPECT_EQ(cell.timing.settle_min_s, .02);
  EXPECT_EQ(cell.timing.settle_max_s, .12);
  EXPECT_EQ(cell.paint.response, PaintResponse::kSaturating);
  EXPECT_EQ(cell.laser.spot_pitches, 1.41);
  EXPECT_FALSE(cell.laser.spot_diameter_m.has_value());
}

TEST(CellFile, HomeOfEveryShippedCellIsWithinWhatPlanningMayUse) {
  for (const fs::directory_entry& entry : fs::directory_iterator(shipped("default").parent_path())) {
    const CellDescription cell = load_cell(entry.path());
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      const AxisDescription& axis = cell.axes[i];
      const double margin = cell.limit_margin * (axis.max - axis.min);
      EXPECT_GE(axis.home, axis.min + margin) << entry.path() << " " << kAxisNames[i];
      EXPECT_LE(axis.home, axis.max - margin) << entry.path() << " " << kAxisNames[i];
    }
  }
}

TEST(CellFile, EveryRemovedKeyIsMissedByItsPath) {
  const Json whole = Json::parse(default_text());
  for (const Json::json_pointer& key : required_keys()) {
    Json json = whole;
    json[key.parent_pointer()].erase(key.back());
    const Refusal refusal = refusal_of(json);
    EXPECT_EQ(refusal.at, json_path(key)) << refusal.sentence;
    EXPECT_TRUE(refusal.sentence.starts_with("missing: expected ")) << refusal.sentence;
  }
}

TEST(CellFile, EveryRenamedKeyIsMissedByItsPathAndTheOtherNameIsFound) {
  const Json whole = Json::parse(default_text());
  for (const Json::json_pointer& key : required_keys()) {
    Json json = whole;
    const Json value = json[key];
    json[key.parent_pointer()].erase(key.back());
    json[key.parent_pointer()][key.back() + "x"] = value;
    const Refusal refusal = refusal_of(json);
    EXPECT_EQ(refusal.at, json_path(key)) << refusal.sentence;
  }
}

TEST(CellFile, EveryKeyOfAnotherTypeIsRefused) {
  const Json whole = Json::parse(default_text());
  for (const Json::json_pointer& key : required_keys()) {
    for (const Json& wrong : {Json(nullptr), Json(true), Json(Json::array({"x"}))}) {
      Json json = whole;
      json[key] = wrong;
      const Refusal refusal = refusal_of(json);
      EXPECT_EQ(refusal.at.substr(0, json_path(key).size()), json_path(key))
          << wrong << " " << refusal.sentence;
      EXPECT_TRUE(refusal.sentence.starts_with("expected ")) << refusal.sentence;
    }
  }
}

TEST(CellFile, EveryNumberFarOutOfRangeIsRefused) {
  const Json whole = Json::parse(default_text());
  int tried = 0;
  for (const Json::json_pointer& key : default_keys()) {
    if (!whole[key].is_number()) continue;
    for (const double wrong : {1e12, -1e12}) {
      Json json = whole;
      json[key] = wrong;
      const Refusal refusal = refusal_of(json);
      EXPECT_EQ(refusal.at, json_path(key));
      EXPECT_TRUE(refusal.sentence.starts_with("expected a number from ")) << refusal.sentence;
      ++tried;
    }
  }
  EXPECT_GT(tried, 100);
}

TEST(CellFile, AnUnknownKeyIsRefusedInEveryObject) {
  const Json whole = Json::parse(default_text());
  std::vector<Json::json_pointer> objects{Json::json_pointer()};
  for (const Json::json_pointer& key : default_keys())
    if (whole[key].is_object()) objects.push_back(key);
  for (const Json::json_pointer& object : objects) {
    Json json = whole;
    json[object]["zzz"] = 1;
    const Refusal refusal = refusal_of(json);
    EXPECT_EQ(refusal.at, json_path(object / "zzz"));
    EXPECT_EQ(refusal.sentence, "unknown key");
  }
}

TEST(CellFile, ValuesThatContradictEachOtherAreRefused) {
  struct Case {
    const char* key;
    Json value;
    const char *at, *sentence;
  };
  const Json curve{{"sampler", "centroid"}, {"wanted", {0, .5, 1}}, {"asked", {0, .6, 1.5}}};
  const auto with = [&](const char* key, const Json& value) {
    Json changed = curve;
    changed[key] = value;
    return Json::array({changed});
  };
  const Case cases[] = {
      {"/axes/j1/max_deg", -132, "$.axes.j1.max_deg", "not above min_deg"},
      {"/axes/j3/home_mm", 301, "$.axes.j3.home_mm", "outside min_mm to max_mm"},
      {"/lens/far_mm", 60, "$.lens.far_mm", "not above near_mm"},
      {"/laser/power_max_mw", 0.1, "$.laser.power_max_mw", "not above power_min_mw"},
      {"/laser/pulse_ms", 51, "$.laser.pulse_ms", "outside pulse_min_ms to pulse_max_ms"},
      {"/laser/pulse_max_ms", 0.5, "$.laser.pulse_max_ms", "below pulse_min_ms"},
      {"/laser/spot_diameter_mm", 0.3, "$.laser.spot_pitches",
       "contradicts spot_diameter_mm: give one of the two"},
      {"/paint/reflectance_black", 1, "$.paint.reflectance_black", "not below reflectance_white"},
      {"/paint/response", "magic", "$.paint.response",
       "expected \"linear\", \"saturating\" or \"sigmoid\", found \"magic\""},
      {"/timing/settle_max_ms", 10, "$.timing.settle_max_ms", "below settle_min_ms"},
      {"/table/tilt_axis_mm",
       {260, 0},
       "$.table.tilt_axis_mm",
       "expected a list of 3 numbers, found a list of 2"},
      {"/table/tilt_axis_mm",
       {260, 0, "x"},
       "$.table.tilt_axis_mm[2]",
       "expected a number from -5000 to 5000, found \"x\""},
      {"/paint/tone_curves", with("wanted", {0, .5, .9}), "$.paint.tone_curves[0].wanted",
       "does not go from 0 to 1"},
      {"/paint/tone_curves", with("wanted", {0, 1, 1}), "$.paint.tone_curves[0].wanted",
       "must increase from each number to the next"},
      {"/paint/tone_curves", with("asked", {0, 1.2, 1.1}), "$.paint.tone_curves[0].asked",
       "must not decrease"},
      {"/paint/tone_curves", with("asked", {0, 1}), "$.paint.tone_curves[0].asked",
       "expected a list of 3 numbers, found a list of 2"},
      {"/paint/tone_curves", with("asked", {0, 1, 2.1}), "$.paint.tone_curves[0].asked[2]",
       "expected a number from 0 to 2, found 2.1"},
      {"/paint/tone_curves",
       {curve, curve},
       "$.paint.tone_curves[1].sampler",
       "\"centroid\" has a curve already"},
      {"/paint/tone_curves", with("x", 1), "$.paint.tone_curves[0].x", "unknown key"},
  };
  for (const Case& c : cases) {
    Json json = Json::parse(default_text());
    json[Json::json_pointer(c.key)] = c.value;
    const Refusal refusal = refusal_of(json);
    EXPECT_EQ(refusal.at, "cell.json: " + std::string(c.at)) << c.key;
    EXPECT_EQ(refusal.sentence, c.sentence) << c.key;
  }
}

TEST(CellFile, SpotDiameterReplacesSpotPitches) {
  Json json = Json::parse(default_text());
  json["laser"].erase("spot_pitches");
  json["laser"]["spot_diameter_mm"] = 0.3;
  const CellDescription cell = cell_from_json(json.dump(), "");
  EXPECT_EQ(cell.laser.spot_diameter_m, .3 / 1e3);
}

TEST(CellFile, ToneIsByTheCurveOfTheSampler) {
  Json json = Json::parse(default_text());
  json["paint"]["reflectance_white"] = .9;
  json["paint"]["reflectance_black"] = .1;
  json["paint"]["tone_curves"] = {{{"sampler", "even"}, {"wanted", {0, 1}}, {"asked", {0, 1.5}}}};
  const CellDescription cell = cell_from_json(json.dump(), "");
  const CellTone centroid = cell_tone(cell, {.sampler = "centroid"});
  EXPECT_TRUE(centroid.options.curve.wanted.empty());
  EXPECT_NE(centroid.warning, "");
  const CellTone even = cell_tone(cell, {.sampler = "even"});
  EXPECT_EQ(even.warning, "");
  EXPECT_EQ(even.options.curve.asked, (std::vector<double>{0, 1.5}));
  EXPECT_EQ(even.options.reflectance_white, .9);
  EXPECT_EQ(even.options.reflectance_black, .1);
}

TEST(CellFile, ToneCurvesAreChosenByPlacementLevelsAndSpot) {
  Json json = Json::parse(default_text());
  const auto entry = [](const char* sampler, const char* curve, int levels, double spot, double black) {
    return Json{{"sampler", sampler},   {"curve", curve},   {"levels", levels},
                {"spot_pitches", spot}, {"wanted", {0, 1}}, {"asked", {0, black}}};
  };
  json["paint"]["tone_curves"] = {
      entry("centroid", "hilbert", 1, 1.4, 1.1), entry("centroid", "hilbert", 1, 2.8, 1.2),
      entry("centroid", "peano2", 1, 1.4, 1.3),  entry("centroid", "hilbert", 3, 1.4, 1.4),
      entry("centroid", "laminar", 1, 1.4, 1.5), entry("even", "peano2", 1, 1.4, 1.6)};
  const CellDescription cell = cell_from_json(json.dump(), "");
  std::string warning;
  const auto black = [&](const char* sampler, const char* curve, int levels, double spot) {
    const CellTone tone =
        cell_tone(cell, {.sampler = sampler, .curve = curve, .levels = levels, .spot_pitches = spot});
    warning = tone.warning;
    return tone.options.curve.asked.empty() ? 0 : tone.options.curve.asked.back();
  };
  EXPECT_EQ(black("centroid", "hilbert", 1, 1.41), 1.1);
  EXPECT_EQ(warning, "");
  EXPECT_EQ(black("centroid", "hilbert", 1, 2.7), 1.2);
  EXPECT_EQ(black("centroid", "peano2", 1, 1.4), 1.3);
  EXPECT_EQ(black("centroid", "hilbert", 3, 1.4), 1.4);
  EXPECT_EQ(black("centroid", "laminar", 1, 1.4), 1.5);
  EXPECT_EQ(warning, "");
  EXPECT_EQ(black("even", "hilbert", 1, 1.4), 1.6);
  EXPECT_NE(warning.find("that on curve \"peano2\" is used"), std::string::npos) << warning;
  EXPECT_EQ(black("centroid", "hilbert", 2, 1.4), 0);
  EXPECT_NE(warning.find("no tone curve for sampler \"centroid\" with 2 levels: tones will be off"),
            std::string::npos);
  EXPECT_EQ(black("centroid", "hilbert", 1, 2), 1.1);
  EXPECT_NE(warning.find("made for a spot of 1.4 pitches"), std::string::npos) << warning;
}

TEST(CellFile, TheShippedCellIsCalibratedForAllThatAJobCanName) {
  const CellDescription cell = load_cell(shipped("default"));
  for (const char* sampler :
       {"centroid", "jittered", "even", "random", "halton", "hammersley", "sobol", "niederreiter", "blue"})
    for (const char* curve : {"hilbert", "peano2"})
      for (int levels = 1; levels <= 4; ++levels)
        EXPECT_EQ(
            cell_tone(cell, {.sampler = sampler, .curve = curve, .levels = levels, .spot_pitches = 1.41})
                .warning,
            "")
            << sampler << " on " << curve << ' ' << levels;
  EXPECT_EQ(
      cell_tone(cell, {.sampler = "centroid", .curve = "laminar", .levels = 1, .spot_pitches = 1.41}).warning,
      "");
}

TEST(CellFile, WarningsNameWhatIsAllowedButOdd) {
  const auto warnings = [](const char* key, const Json& value) {
    Json json = Json::parse(default_text());
    json["paint"]["tone_curves"] = {{{"sampler", "centroid"}, {"wanted", {0, 1}}, {"asked", {0, 1.5}}}};
    json[Json::json_pointer(key)] = value;
    return cell_warnings(cell_from_json(json.dump(), ""));
  };
  EXPECT_TRUE(warnings("/name", "x").empty());
  ASSERT_EQ(warnings("/laser/spot_pitches", 1.19).size(), 1u);
  EXPECT_TRUE(warnings("/laser/spot_pitches", 1.19)[0].starts_with(
      "$.laser.spot_pitches: 1.19 is outside 1.2 to 1.8"));
  EXPECT_EQ(warnings("/laser/spot_pitches", 1.81).size(), 1u);
  EXPECT_TRUE(warnings("/laser/spot_pitches", 1.2).empty());
  EXPECT_EQ(warnings("/paint/tone_curves", Json::array()).size(), 1u);
  EXPECT_EQ(warnings("/table/tilt_axis_mm", {480, 0, 100}).size(), 1u);
  EXPECT_EQ(warnings("/lens/near_mm", 10).size(), 1u);
}

TEST(CellFile, LinksRunAboveTheLensUnlessTheFileSaysWhere) {
  Json json = Json::parse(default_text());
  CellDescription cell = cell_from_json(json.dump(), "");
  const double lens_top_m = .04 * std::sin(45 * kDegree) + .015 * std::cos(45 * kDegree);
  EXPECT_EQ(cell.arm.fore_link.radius_m, .035);
  EXPECT_NEAR(cell.arm.fore_link.height_m, .3 + lens_top_m + .03 + .035, 1e-12);
  EXPECT_EQ(cell.arm.upper_link.height_m, cell.arm.fore_link.height_m);
  EXPECT_EQ(cell.arm.quill_length_m, cell.arm.fore_link.height_m);
  EXPECT_TRUE(cell_warnings(cell).empty());

  json["arm"]["forearm_height_mm"] = 250;
  json["arm"]["forearm_radius_mm"] = 20;
  json["arm"]["upper_arm_height_mm"] = 320;
  json["arm"]["quill_length_mm"] = 280;
  cell = cell_from_json(json.dump(), "");
  EXPECT_DOUBLE_EQ(cell.arm.fore_link.height_m, .25);
  EXPECT_DOUBLE_EQ(cell.arm.upper_link.radius_m, .02);
  EXPECT_DOUBLE_EQ(cell.arm.upper_link.height_m, .32);
  EXPECT_DOUBLE_EQ(cell.arm.quill_length_m, .28);
  ASSERT_EQ(cell_warnings(cell).size(), 1u);
  EXPECT_TRUE(cell_warnings(cell)[0].starts_with("$.arm.forearm_height_mm"));
  json["arm"]["forearm_radius_mm"] = -1;
  EXPECT_EQ(refusal_of(json).at, "cell.json: $.arm.forearm_radius_mm");
}

TEST(CellFile, TheColumnEndsUnderTheUpperArmUnlessTheFileSaysWhere) {
  Json json = Json::parse(default_text());
  CellDescription cell = cell_from_json(json.dump(), "");
  EXPECT_DOUBLE_EQ(cell.arm.column.radius_m, .06);
  EXPECT_DOUBLE_EQ(cell.arm.column.height_m, .36);

  json["arm"].erase("column_height_mm");
  cell = cell_from_json(json.dump(), "");
  EXPECT_DOUBLE_EQ(cell.arm.column.height_m, cell.arm.upper_link.height_m - cell.arm.upper_link.radius_m);

  json["arm"]["column_radius_mm"] = 240;
  cell = cell_from_json(json.dump(), "");
  ASSERT_EQ(cell_warnings(cell).size(), 1u);
  EXPECT_TRUE(cell_warnings(cell)[0].starts_with("$.arm.column_radius_mm"));
  json["arm"]["column_radius_mm"] = -1;
  EXPECT_EQ(refusal_of(json).at, "cell.json: $.arm.column_radius_mm");

  json["arm"].erase("column_radius_mm");
  EXPECT_EQ(cell_from_json(json.dump(), "").arm.column.radius_m, 0);
  json["arm"]["column_height_mm"] = 300;
  EXPECT_EQ(refusal_of(json).at, "cell.json: $.arm.column_height_mm");
}

TEST(CellFile, MeasuredMotionIsOptional) {
  Json json = Json::parse(default_text());
  CellDescription cell = cell_from_json(json.dump(), "");
  EXPECT_EQ(cell.timing.move_delay_s, 0);
  EXPECT_EQ(cell.axes[kJ3].time_factor, 1);
  json["measured"] = {{"move_delay_ms", 1.5}, {"time_factor", {{"j3", 1.25}, {"c", .9}}}};
  cell = cell_from_json(json.dump(), "");
  EXPECT_DOUBLE_EQ(cell.timing.move_delay_s, .0015);
  EXPECT_EQ(cell.axes[kJ3].time_factor, 1.25);
  EXPECT_EQ(cell.axes[kRotation].time_factor, .9);
  EXPECT_EQ(cell.axes[kJ1].time_factor, 1);
  json["measured"]["time_factor"]["j3"] = .1;
  EXPECT_EQ(refusal_of(json).at, "cell.json: $.measured.time_factor.j3");
  json["measured"] = {{"settle_ms", 1}};
  EXPECT_EQ(refusal_of(json).at, "cell.json: $.measured.settle_ms");
}

TEST(CellFile, InterpolationIsUnknownUnlessTheFileSaysIt) {
  Json json = Json::parse(default_text());
  CellDescription cell = cell_from_json(json.dump(), "");
  EXPECT_EQ(cell.motion.robot, Interpolation::kUnknown);
  EXPECT_EQ(cell.motion.table, Interpolation::kUnknown);
  EXPECT_EQ(cell.motion.start_lag_s, .02);
  json["interpolation"] = {{"robot", "coordinated"}, {"table", "independent"}, {"start_lag_ms", 5}};
  cell = cell_from_json(json.dump(), "");
  EXPECT_EQ(cell.motion.robot, Interpolation::kCoordinated);
  EXPECT_EQ(cell.motion.table, Interpolation::kIndependent);
  EXPECT_EQ(cell.motion.start_lag_s, .005);
  json["interpolation"] = {{"table", "unknown"}};
  EXPECT_EQ(cell_from_json(json.dump(), "").motion.table, Interpolation::kUnknown);
  json["interpolation"] = {{"robot", "linear"}};
  EXPECT_EQ(refusal_of(json).at, "cell.json: $.interpolation.robot");
  json["interpolation"] = {{"start_lag_ms", -1}};
  EXPECT_EQ(refusal_of(json).at, "cell.json: $.interpolation.start_lag_ms");
  json["interpolation"] = {{"arm", "independent"}};
  EXPECT_EQ(refusal_of(json).at, "cell.json: $.interpolation.arm");
}

TEST(CellFile, CellsAreFoundByNameOrPath) {
  EXPECT_EQ(find_cell("default"), shipped("default"));
  EXPECT_EQ(find_cell(shipped("default").string()), shipped("default"));
  EXPECT_THROW(find_cell("./nothing.json"), InputError);
  EXPECT_THROW(find_cell(""), InputError);
  try {
    find_cell("nothing");
    ADD_FAILURE() << "found";
  } catch (const InputError& error) {
    EXPECT_NE(error.sentence().find("known: default"), std::string::npos) << error.what();
  }
}

TEST(CellFile, AnotherFolderOfCellsCanBeNamedByTheEnvironment) {
  const fs::path folder = fs::path(testing::TempDir()) / "hilbrush_cells_test";
  fs::create_directories(folder);
  std::ofstream(folder / "mine.json") << default_text();
  setenv("HILBRUSH_CELLS", folder.c_str(), 1);
  EXPECT_EQ(find_cell("mine"), folder / "mine.json");
  EXPECT_THROW(find_cell("default"), InputError);
  EXPECT_EQ(known_cells(), std::vector<std::string>{"mine"});
  unsetenv("HILBRUSH_CELLS");
  fs::remove_all(folder);
}

}  // namespace
}  // namespace hilbrush
