#include "config/wired_cell_file.h"

#include <nlohmann/json.hpp>

#include "sampling/base/input_error.h"

namespace hilbrush {
namespace {

using OrderedJson = nlohmann::ordered_json;

OrderedJson robot_entry(const WireEndpoints& endpoints) {
  return {{"driver", "dobot"},
          {"host", endpoints.host},
          {"dashboard_port", endpoints.dashboard_port},
          {"motion_port", endpoints.motion_port},
          {"feedback_port", endpoints.feedback_port}};
}

OrderedJson table_entry(const WireEndpoints& endpoints) {
  OrderedJson table{{"driver", endpoints.table_driver}};
  if (!endpoints.table_map.empty()) table["map"] = endpoints.table_map;
  if (endpoints.table_serial.empty()) {
    table["host"] = endpoints.host;
    table["tcp_port"] = endpoints.table_tcp_port;
  } else {
    table["port"] = endpoints.table_serial;
  }
  for (const auto& [axis, unit] : {std::pair{"a", 1}, std::pair{"c", 2}})
    table["axes"][axis] = {{"unit", unit}, {"steps_per_deg", endpoints.steps_per_deg}};
  return table;
}

OrderedJson laser_entry(const WireEndpoints& endpoints) {
  OrderedJson gate{{"of", endpoints.is_gate_of_robot ? "robot" : "laser"}};
  if (endpoints.is_gate_of_robot) gate["output"] = endpoints.gate_output;
  return {{"driver", endpoints.laser_driver}, {"port", endpoints.laser_port}, {"gate", gate}};
}

}  // namespace

std::string wired_cell_text(const std::string& cell_text, const WireEndpoints& endpoints, double time_scale) {
  OrderedJson cell = OrderedJson::parse(cell_text, nullptr, false);
  if (!cell.is_object()) throw InputError("$", "is not a JSON object");
  cell["devices"] = {{"robot", robot_entry(endpoints)},
                     {"table", table_entry(endpoints)},
                     {"laser", laser_entry(endpoints)}};
  cell["simulation"]["time_scale"] = time_scale;
  return cell.dump(2) + "\n";
}

}  // namespace hilbrush
