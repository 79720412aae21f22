#pragma once
#include <memory>

#include "drivers/cell.h"
#include "planner/cell_description.h"
#include "sim/devices/emission_record.h"

/// The simulated cell in process: robot, table and laser behind the drivers' interfaces, on a clock that runs at the cell file's
/// time_scale (0: virtual time that jumps to whatever is slept for). Axes follow trapezoidal profiles and settle; positions are true
/// functions of time. Thread-safe as the interfaces say.
namespace hilbrush {

class SimCell {
 public:
  explicit SimCell(const CellDescription& description);
  ~SimCell();

  Cell cell();
  /// Where emissions go from now on; empty: dropped.
  void set_emission_sink(EmissionSink sink);
  /// True joint values now.
  Joints joints() const;
  /// Opens or closes the interlock; opening cuts a running pulse.
  void set_interlock_closed(bool closed);

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace hilbrush
