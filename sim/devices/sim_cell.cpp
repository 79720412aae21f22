#include "sim/devices/sim_cell.h"

#include <mutex>

#include "sim/devices/sim_axis_group.h"
#include "sim/devices/sim_laser.h"

namespace hilbrush {

/// One mutex for the whole cell: what the laser records about the axes is then one instant's truth, and no
/// lock order can go wrong.
struct SimCell::Implementation {
  Implementation(const CellDescription& description, const SimCellOptions& options)
      : clock(description.simulation.time_scale),
        laser(description, options.laser_start_delay_s, mutex, clock,
              [this](double now_s) { return axes_at(now_s); }),
        robot("robot", description, kJ1, mutex, clock, [this](double now_s) { laser.note_motion(now_s); }),
        table("table", description, kTilt, mutex, clock, [this](double now_s) { laser.note_motion(now_s); }) {
  }

  SimLaser::AxesState axes_at(double now_s) const {
    SimLaser::AxesState axes;
    const auto robot_positions = robot.positions_at(now_s);
    const auto table_positions = table.positions_at(now_s);
    std::copy(robot_positions.begin(), robot_positions.end(), axes.joints.begin() + kJ1);
    std::copy(table_positions.begin(), table_positions.end(), axes.joints.begin() + kTilt);
    axes.is_settled = robot.is_settled(now_s) && table.is_settled(now_s);
    return axes;
  }

  std::mutex mutex;
  SimClock clock;
  SimLaser laser;
  SimAxisGroup<4> robot;
  SimAxisGroup<2> table;
};

SimCell::SimCell(const CellDescription& description, const SimCellOptions& options)
    : implementation_(std::make_unique<Implementation>(description, options)) {}

SimCell::~SimCell() = default;

Cell SimCell::cell() {
  return {implementation_->robot, implementation_->table, implementation_->laser, implementation_->clock};
}

void SimCell::set_emission_sink(EmissionSink sink) {
  implementation_->laser.set_sink(std::move(sink));
}

Joints SimCell::joints() const {
  const std::lock_guard lock(implementation_->mutex);
  return implementation_->axes_at(implementation_->clock.now_s()).joints;
}

void SimCell::set_interlock_closed(bool closed) {
  implementation_->laser.set_interlock_closed(closed);
}
void SimCell::fail_robot(const std::string& fault) {
  implementation_->robot.fail(fault);
}
void SimCell::fail_table(const std::string& fault) {
  implementation_->table.fail(fault);
}

}  // namespace hilbrush
