#include "planner/cell_model/program_time.h"

#include <algorithm>

#include "planner/cell_model/time_model.h"

namespace hilbrush {

TimeSplit estimate_time(const CellDescription& cell, const ExposureProgram& program,
                        const TimeVisitor& visit) {
  TimeSplit time;
  Joints at = home_joints(cell);
  double ringing_s =
      0;  // settling that is left over from way-points passed without it, see Run::move of the executor
  const auto move_to = [&](const Joints& to, double& spent_s) {
    const double travel_s = move_s(cell, at, to);
    ringing_s = std::max(settle_s(cell, at, to), ringing_s - travel_s);
    spent_s += travel_s + cell.timing.message_s + cell.timing.move_delay_s;
    at = to;
  };
  std::size_t next_via = 0;
  for (std::size_t i = 0; i <= program.exposures.size(); ++i) {
    bool is_repose = false;
    for (; next_via < program.vias.size() && program.vias[next_via].before_exposure <= i; ++next_via) {
      move_to(program.vias[next_via].joints, time.retract_s);
      is_repose = true;
    }
    if (i == program.exposures.size()) break;
    const Exposure& exposure = program.exposures[i];
    move_to(exposure.joints, is_repose ? time.retract_s : time.move_s);
    time.settle_s += ringing_s;
    ringing_s = 0;
    time.expose_s += static_cast<double>(exposure.pulse_s) + cell.timing.message_s;
    if (visit) visit(i, time);
  }
  return time;
}

double least_time_s(const CellDescription& cell, const ExposureProgram& program) {
  double sum_s = 0;
  for (const Exposure& exposure : program.exposures)
    sum_s += cell.timing.settle_min_s + static_cast<double>(exposure.pulse_s) + cell.timing.tick_s;
  return sum_s;
}

}  // namespace hilbrush
