#pragma once
#include "sim/script/fault_script.h"

namespace hilbrush {

/// Which devices a simulated cell on wires has, and how fast its time goes.
struct WireOptions {
  enum class Table { kOrientalAz, kCia402, kLeadshinePr };
  enum class LaserHead { kObis, kCobolt };
  Table table = Table::kOrientalAz;
  bool is_table_serial = false;  ///< Modbus RTU on a pseudo-terminal instead of TCP
  LaserHead laser = LaserHead::kObis;
  bool is_laser_serial = false;                ///< a pseudo-terminal instead of a TCP port
  double time_scale = 1;                       ///< wall seconds of one cell second, > 0
  double steps_per_deg = 2777.77777777777777;  ///< a motor of 10,000 steps a turn behind a gear of 100
  double start_delay_s = 5;
  double warm_up_s = 0;
  double notice_s = .03;  ///< see TrueCellOptions
  FaultScript faults;
};

}  // namespace hilbrush
