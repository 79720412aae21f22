#include "config/cell_devices.h"

#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <sstream>

#include "config/cell_file.h"
#include "config/register_map_file.h"
#include "sampling/base/angles.h"
#include "sampling/base/input_error.h"

namespace hilbrush {
namespace {

using Json = nlohmann::ordered_json;

std::string source(const std::string& path) {
  return std::string(HILBRUSH_SOURCE_DIR) + "/" + path;
}

/// The shipped cell with other devices.
Json cell_with(const char* devices) {
  std::ifstream file(source("config/cells/default.json"));
  Json json = Json::parse(file);
  json["devices"] = Json::parse(devices);
  return json;
}

constexpr const char* kReal = R"({
  "robot": {"driver": "dobot", "host": "10.0.0.6", "motion_port": 3, "axes": {"j1": {"sign": -1, "offset_deg": 90}, "j3": {"offset_mm": 10}}},
  "table": {"driver": "oriental-az", "port": "/dev/ttyUSB0", "parity": "none",
            "axes": {"a": {"unit": 1, "steps_per_deg": 100}, "c": {"unit": 2, "steps_per_deg": 50, "home": "reference_run"}}},
  "laser": {"driver": "obis", "port": "tcp://10.0.0.7:4001", "gate": {"of": "robot", "output": 3}}})";

InputError device_refusal_of(const Json& json) {
  try {
    cell_devices_from_json(json.dump(), "cell.json");
  } catch (const InputError& error) {
    return error;
  }
  ADD_FAILURE() << "not refused: " << json["devices"].dump();
  return InputError("", "");
}

TEST(CellDevices, SimulatedDevicesNeedNothing) {
  const auto options = cell_devices_from_json(
      cell_with(R"({"robot": "simulated", "table": {"driver": "simulated"}, "laser": "simulated"})").dump(),
      "");
  EXPECT_TRUE(options.is_simulated());
}

TEST(CellDevices, RealDevicesAreReadInTheCellsUnits) {
  const Json json = cell_with(kReal);
  const auto options = cell_devices_from_json(json.dump(), "");
  EXPECT_FALSE(options.is_simulated());
  const auto& dobot = std::get<DobotOptions>(options.robot);
  EXPECT_EQ(dobot.host, "10.0.0.6");
  EXPECT_EQ(dobot.dashboard_port, 29999);
  EXPECT_EQ(dobot.motion_port, 3);
  EXPECT_NEAR(dobot.scales[0].to_device(91 * kDegree), -1, 1e-12);
  EXPECT_NEAR(dobot.scales[0].to_si(-1), 91 * kDegree, 1e-12);
  EXPECT_NEAR(dobot.scales[2].to_device(.0125), 2.5, 1e-12);
  EXPECT_NEAR(dobot.bounds[0].max, 132 * kDegree, 1e-12);
  const auto& table = std::get<ModbusGroupOptions<2>>(options.table);
  EXPECT_EQ(table.axes[0].endpoint.port, "/dev/ttyUSB0");
  EXPECT_EQ(table.axes[0].endpoint.parity, 'N');
  EXPECT_TRUE(table.axes[0].endpoint == table.axes[1].endpoint);
  EXPECT_NEAR(table.axes[1].scale.to_device(10 * kDegree), 500, 1e-9);
  EXPECT_FALSE(table.axes[0].homes_to_zero);
  EXPECT_TRUE(table.axes[1].homes_to_zero);
  const auto& obis = std::get<ObisDevice>(options.laser);
  EXPECT_EQ(obis.laser.port, "tcp://10.0.0.7:4001");
  EXPECT_EQ(obis.gate.output, 3);
}

TEST(CellDevices, DriversAreCalledAsTheFileCallsThem) {
  const auto names = [](const char* devices) {
    const DriverNames drivers = driver_names(cell_devices_from_json(cell_with(devices).dump(), ""));
    return std::string(drivers.robot) + " " + drivers.table + " " + drivers.laser;
  };
  EXPECT_EQ(names(R"({"robot": "simulated", "table": "simulated", "laser": "simulated"})"),
            "simulated simulated simulated");
  EXPECT_EQ(names(kReal), "dobot oriental-az obis");
  EXPECT_EQ(names(R"({
    "robot": {"driver": "modbus-axes", "map": "cia402", "host": "10.0.0.6",
              "axes": {"j1": {"unit": 1, "steps_per_deg": 100}, "j2": {"unit": 2, "steps_per_deg": 100},
                       "j3": {"unit": 3, "steps_per_mm": 100}, "j4": {"unit": 4, "steps_per_deg": 100}}},
    "table": {"driver": "modbus-axes", "map": "leadshine-pr", "port": "/dev/ttyUSB0",
              "axes": {"a": {"unit": 1, "steps_per_deg": 100}, "c": {"unit": 2, "steps_per_deg": 100}}},
    "laser": {"driver": "cobolt", "port": "/dev/ttyACM0", "gate": {"of": "laser"}}})"),
            "modbus-axes modbus-axes cobolt");
}

TEST(CellDevices, RefusalsNameTheirPlace) {
  const auto refused_at = [](const std::function<void(Json&)>& change) {
    Json json = cell_with(kReal);
    change(json["devices"]);
    return device_refusal_of(json).at();
  };
  EXPECT_EQ(refused_at([](Json& d) { d["robot"] = "dobot"; }), "cell.json: $.devices.robot");
  EXPECT_EQ(refused_at([](Json& d) { d["robot"] = "robby"; }), "cell.json: $.devices.robot");
  EXPECT_EQ(refused_at([](Json& d) { d["robot"]["driver"] = "obis"; }), "cell.json: $.devices.robot.driver");
  EXPECT_EQ(refused_at([](Json& d) { d["robot"].erase("host"); }), "cell.json: $.devices.robot.host");
  EXPECT_EQ(refused_at([](Json& d) { d["robot"]["hosts"] = "x"; }), "cell.json: $.devices.robot.hosts");
  EXPECT_EQ(refused_at([](Json& d) { d["robot"]["motion_port"] = 70000; }),
            "cell.json: $.devices.robot.motion_port");
  EXPECT_EQ(refused_at([](Json& d) { d["robot"]["axes"]["j1"]["sign"] = .5; }),
            "cell.json: $.devices.robot.axes.j1.sign");
  EXPECT_EQ(refused_at([](Json& d) { d["table"]["host"] = "x"; }), "cell.json: $.devices.table.host");
  EXPECT_EQ(refused_at([](Json& d) { d["table"]["axes"]["c"]["unit"] = 1; }),
            "cell.json: $.devices.table.axes.c.unit");
  EXPECT_EQ(refused_at([](Json& d) { d["table"]["driver"] = "modbus-axes"; }),
            "cell.json: $.devices.table.map");
  EXPECT_EQ(refused_at([](Json& d) {
              d["table"]["driver"] = "modbus-axes";
              d["table"]["map"] = "none-such";
            }),
            "cell.json: $.devices.table.map");
  EXPECT_EQ(refused_at([](Json& d) { d["laser"]["gate"]["of"] = "laser"; }),
            "cell.json: $.devices.laser.gate.of");
  EXPECT_EQ(refused_at([](Json& d) { d["robot"] = "simulated"; }), "cell.json: $.devices.laser.gate.of");
  EXPECT_EQ(refused_at([](Json& d) { d["laser"]["gate"]["output"] = 0; }),
            "cell.json: $.devices.laser.gate.output");
}

TEST(RegisterMaps, TheShippedOnesAreReadAndFoundByName) {
  for (const char* name : {"cia402", "leadshine-pr"}) {
    const auto file = find_register_map(name, "/", "map");
    const RegisterMap map = load_register_map(file);
    EXPECT_FALSE(map.move.empty()) << name;
    EXPECT_FALSE(map.stop.empty()) << name;
    EXPECT_FALSE(map.fault.empty()) << name;
  }
  EXPECT_THROW(find_register_map("none-such", "/", "map"), InputError);
}

TEST(RegisterMaps, RefusalsNameTheirPlace) {
  std::ifstream file(source("config/axes/cia402.json"));
  const Json shipped = Json::parse(file);
  const auto refused_at = [&](const std::function<void(Json&)>& change) -> std::string {
    Json json = shipped;
    change(json);
    try {
      register_map_from_json(json.dump(), "map.json");
    } catch (const InputError& error) {
      return error.at();
    }
    return "not refused";
  };
  EXPECT_EQ(refused_at([](Json& m) { m["position"] = "nowhere"; }), "map.json: $.position");
  EXPECT_EQ(refused_at([](Json& m) { m["word_order"] = "sideways"; }), "map.json: $.word_order");
  EXPECT_EQ(refused_at([](Json& m) { m["registers"]["mode"]["address"] = "0x10000"; }),
            "map.json: $.registers.mode.address");
  EXPECT_EQ(refused_at([](Json& m) { m["registers"]["mode"]["words"] = 3; }),
            "map.json: $.registers.mode.words");
  EXPECT_EQ(refused_at([](Json& m) { m["stop"] = Json::array(); }), "map.json: $.stop");
  EXPECT_EQ(refused_at([](Json& m) { m.erase("prepare"); }), "map.json: $.move") << "no target";
  const auto step = [](const char* text) { return Json::parse(text); };
  EXPECT_EQ(refused_at([&](Json& m) { m["prepare"].push_back(step(R"({"write": "mode", "value": 1})")); }),
            "map.json: $.prepare");
  EXPECT_EQ(refused_at([&](Json& m) { m["prepare"].push_back(step(R"({"pause_ms": 1})")); }),
            "map.json: $.prepare");
  EXPECT_EQ(refused_at([&](Json& m) {
              m["prepare"].push_back(step(R"({"write": "controlword", "from": "speed"})"));
            }),
            "map.json: $.prepare")
      << "it starts moves";
  EXPECT_EQ(refused_at([&](Json& m) {
              m["registers"]["alias"] = step(R"({"address": "0x603F", "words": 2})");
              m["prepare"].push_back(step(R"({"write": "alias", "from": "speed"})"));
            }),
            "map.json: $.prepare")
      << "it shares a word with what starts moves";
  EXPECT_EQ(refused_at([](Json& m) { m["arrived"] = Json::array(); }), "map.json: $.arrived");
  EXPECT_EQ(refused_at([](Json& m) { m["fault"][0]["equals"] = "0x0010"; }), "map.json: $.fault[0].equals");
}

}  // namespace
}  // namespace hilbrush
