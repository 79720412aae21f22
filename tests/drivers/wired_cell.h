#pragma once
#include <gtest/gtest.h>

#include <memory>
#include <mutex>
#include <vector>

#include "drivers/axes/drive_group.h"
#include "drivers/axes/oriental_az.h"
#include "drivers/dobot/dobot_robot.h"
#include "drivers/laser/gated_laser.h"
#include "drivers/laser/obis_head.h"
#include "drivers/steady_clock.h"
#include "sim/wire/wire_cell.h"
#include "tests/daemon/execution/program_fixture.h"

/// The drivers at one end of real wires, a simulated cell at the other, on clocks of the same scale.
namespace hilbrush::test {

class WiredCell {
 public:
  static WireOptions quick(double scale = 0.1) {
    WireOptions options;
    options.time_scale = scale;
    options.start_delay_s = 1;
    return options;
  }

  explicit WiredCell(const WireOptions& options = quick())
      : description(small_cell()), wire(description, options), clock(options.time_scale) {
    wire.set_emission_sink([this](const Emission& emission) {
      const std::lock_guard lock(mutex_);
      emissions_.push_back(emission);
    });
    robot = std::make_unique<DobotRobot>(dobot_options(), clock);
    if (wire.endpoints().table_driver == "oriental-az") table = make_table();
    if (wire.endpoints().laser_driver == "obis")
      laser = std::make_unique<GatedLaser>(std::make_unique<ObisHead>(laser_options(), clock), robot->gate(1),
                                           laser_limits(), clock);
  }

  DobotOptions dobot_options() const {
    DobotOptions options;
    const WireEndpoints& at = wire.endpoints();
    options.host = at.host;
    options.dashboard_port = at.dashboard_port;
    options.motion_port = at.motion_port;
    options.feedback_port = at.feedback_port;
    for (std::size_t i = 0; i < 4; ++i) {
      options.scales[i].steps_per_unit = i == kJ3 ? 1e3 : 180 / 3.14159265358979323846;
      options.bounds[i] = bounds(i);
    }
    return options;
  }
  std::array<ModbusAxisOptions, 2> axis_options() const {
    std::array<ModbusAxisOptions, 2> options;
    for (std::size_t i = 0; i < 2; ++i) {
      options[i].endpoint.host = wire.endpoints().host;
      options[i].endpoint.tcp_port = wire.endpoints().table_tcp_port;
      options[i].unit = static_cast<int>(i) + 1;
      options[i].scale.steps_per_unit = wire.endpoints().steps_per_deg * 180 / 3.14159265358979323846;
      options[i].bounds = bounds(kTilt + i);
      options[i].window = 5e-5;
    }
    return options;
  }
  LaserOptions laser_options() const {
    LaserOptions options;
    options.port = wire.endpoints().laser_port;
    options.power_min_w = description.laser.power_min_w;
    options.power_max_w = description.laser.power_max_w;
    return options;
  }
  Laser::Limits laser_limits() const {
    const auto& limits = description.laser;
    return {limits.power_min_w, limits.power_max_w, limits.pulse_min_s, limits.pulse_max_s};
  }
  std::unique_ptr<DriveGroup<2>> make_table() {
    const auto options = axis_options();
    auto bus = std::make_shared<ModbusBus>(options[0].endpoint);
    std::array<std::unique_ptr<AxisDrive>, 2> drives{std::make_unique<OrientalDrive>(bus, options[0]),
                                                     std::make_unique<OrientalDrive>(bus, options[1])};
    return std::make_unique<DriveGroup<2>>("table", options, std::move(drives), clock);
  }

  template <class Axes>
  static void make_ready(Axes& axes) {
    axes.connect();
    axes.enable();
    axes.home();
  }
  /// Begins now, whatever the device is doing.
  void begin_fault(WireFaultKind kind, WireDevice device, double duration_s = WireFault{}.duration_s) {
    WireFault fault;
    fault.kind = kind;
    fault.device = device;
    fault.trigger.at_s = wire.now_s();
    fault.duration_s = duration_s;
    wire.add_fault(fault);
  }
  /// Waits on the cell's clock as the executor does; false after `cell_s`.
  template <class Condition>
  bool wait_for(Condition condition, double cell_s = 20) {
    const double deadline_s = clock.now_s() + cell_s;
    while (!condition()) {
      if (clock.now_s() > deadline_s) return false;
      clock.sleep_until(clock.now_s() + .02);
    }
    return true;
  }
  std::vector<Emission> emissions() {
    const std::lock_guard lock(mutex_);
    return emissions_;
  }

  CellDescription description;
  WireCell wire;
  SteadyClock clock;
  std::unique_ptr<DobotRobot> robot;
  std::unique_ptr<DriveGroup<2>> table;
  std::unique_ptr<GatedLaser> laser;

 private:
  AxisBounds bounds(std::size_t axis) const {
    const AxisDescription& limits = description.axes[axis];
    return {limits.min, limits.max, limits.speed_max, limits.acceleration_max};
  }
  std::mutex mutex_;
  std::vector<Emission> emissions_;
};

}  // namespace hilbrush::test
