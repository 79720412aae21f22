#pragma once
#include <memory>
#include <string>

#include "drivers/cell.h"
#include "planner/cell_model/cell_description.h"
#include "sim/devices/emission_record.h"

/// The simulated cell in process: robot, table and laser behind the drivers' interfaces, on a clock that runs
/// at the cell file's time_scale (0: virtual time that jumps to whatever is slept for). Axes follow
/// trapezoidal profiles and settle; positions are true functions of time. Thread-safe as the interfaces say.
/// It starts disconnected, at the axes' home positions, interlock closed, laser off.
namespace hilbrush {

struct SimCellOptions {
  double laser_start_delay_s = 5;  ///< what enabling the laser takes, on the cell's clock (CDRH: 5 s)
};

class SimCell {
 public:
  explicit SimCell(const CellDescription& description, const SimCellOptions& options = {});
  /// A pulse that is still on is cut and recorded.
  ~SimCell();

  Cell cell();
  /// Where emissions go from now on; empty: dropped. If the sink throws, the laser reports a fault.
  void set_emission_sink(EmissionSink sink);
  /// True joint values now.
  Joints joints() const;
  /// Opens or closes the interlock; opening cuts a running pulse and leaves an enabled laser in fault. From
  /// any thread.
  void set_interlock_closed(bool closed);
  /// Breaks a device, as a scripted fault: it brakes and reports the sentence until its fault is cleared.
  /// From any thread.
  void fail_robot(const std::string& fault);
  void fail_table(const std::string& fault);

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace hilbrush
