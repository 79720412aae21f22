#pragma once
#include <cstdint>
#include <string>

/// Where the devices of a simulated cell are to be found, as a cell file names them. Data only.
namespace hilbrush {

struct WireEndpoints {
  std::string host = "127.0.0.1";
  std::uint16_t dashboard_port = 0;
  std::uint16_t motion_port = 0;
  std::uint16_t feedback_port = 0;
  int gate_output = 1;

  std::string table_driver;          ///< "oriental-az" or "modbus-axes"
  std::string table_map;             ///< of modbus-axes: "cia402" or "leadshine-pr"
  std::uint16_t table_tcp_port = 0;  ///< or
  std::string table_serial;          ///< the path of a pseudo-terminal
  double steps_per_deg = 0;

  std::string laser_driver;  ///< "obis" or "cobolt"
  std::string laser_port;    ///< the path of a pseudo-terminal, or tcp://HOST:PORT
  bool is_gate_of_robot = true;
};

}  // namespace hilbrush
