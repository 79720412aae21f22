#pragma once
#include <functional>
#include <string>

#include "drivers/cell.h"
#include "sim/wire/wired_devices.h"

/// The devices of the simulated cell, with all their faults, behind the drivers' interfaces without any wire
/// between: under virtual time, in which thousands of jobs with faults take seconds. These replacements of
/// the drivers are only as careful as drivers must be: they believe a device that reports "in position" at
/// its target for the settle time; an exchange that fails leaves the link lost.
namespace hilbrush::test {

class VirtualClock final : public Clock {
 public:
  explicit VirtualClock(WiredDevices& devices) : devices_(devices) {}
  double now_s() const override { return devices_.cell().now_s(); }
  void sleep_until(double time_s) override;
  void wake() override {}
  /// Called once for each exchange and sleep: for actions at a chosen moment (an operator's stop).
  std::function<void()> on_time;

 private:
  WiredDevices& devices_;
};

/// An exchange with a device: takes time, may fail by the fault script.
class VirtualLink {
 public:
  VirtualLink(WireDevice device, WiredDevices& devices, VirtualClock& clock)
      : device_(device), devices_(devices), clock_(clock) {}
  /// `act` is what the device does when it obeys; false: it refuses. @throws DriverError as the fault wants
  /// it
  void exchange(const std::function<bool()>& act);
  bool is_lost() const { return !lost_.empty(); }
  const std::string& why() const { return lost_; }
  void connect() { lost_.clear(); }

 private:
  static constexpr double kExchangeS = 2e-4;
  static constexpr double kReplyTimeoutS = .1;
  [[noreturn]] void lose(const std::string& how);
  const WireDevice device_;
  WiredDevices& devices_;
  VirtualClock& clock_;
  std::string lost_;
};

/// A device's life cycle over such a link.
class VirtualDevice {
 public:
  VirtualDevice(WireDevice device, WiredDevices& devices, VirtualClock& clock)
      : devices_(devices), clock_(clock), link_(device, devices, clock) {}

 protected:
  void fail(const std::string& sentence);
  void fault_if_lost();
  WiredDevices& devices_;
  VirtualClock& clock_;
  VirtualLink link_;
  DeviceState state_ = DeviceState::kDisconnected;
  std::string fault_;
};

/// What robot and table have in common: where they were sent, where they were last seen, and since when they
/// rest.
template <std::size_t N>
class VirtualAxes : public AxisGroup<N>, protected VirtualDevice {
 public:
  using Positions = typename AxisGroup<N>::Positions;
  using Status = typename AxisGroup<N>::Status;
  using VirtualDevice::VirtualDevice;

  void home() override;
  void disable() noexcept override;
  void move_to(const Positions& target, double settle_s) override;
  Status status() override;
  double expected_arrival_s() override;
  void stop() noexcept override;

 protected:
  /// Reads where the axes are, and what the device says of itself; a reading that fails is one less.
  virtual void read_state() = 0;
  virtual void order_move(const Positions& target) = 0;
  virtual void order_stop() = 0;
  /// Whether the device, as last seen, says that nothing moves.
  virtual bool is_at_rest() const = 0;
  /// After each reading: what of it is a fault.
  virtual void judge() {}

  Positions seen_{};

 private:
  Positions target_{};
  bool has_target_ = false;
  double settle_s_ = 0;
  double rest_since_s_ = -1;
};

class VirtualRobot final : public VirtualAxes<4> {
 public:
  VirtualRobot(WiredDevices& devices, VirtualClock& clock)
      : VirtualAxes(WireDevice::kRobot, devices, clock) {}
  void connect() override;
  void enable() override;
  void clear_fault() override;

  // The gate: an output of the robot.
  void pulse(double pulse_s);
  bool gate_off() noexcept;
  bool is_gate_on();

 private:
  void command(bool is_motion, const std::string& name, const std::vector<std::string>& arguments);
  void read_state() override;
  void order_move(const Positions& target) override;
  void order_stop() override { command(false, "resetrobot", {}); }
  bool is_at_rest() const override;
  void judge() override;
  int mode_ = 4;
  bool is_output_on_ = false;
};

class VirtualTable final : public VirtualAxes<2> {
 public:
  VirtualTable(WiredDevices& devices, VirtualClock& clock)
      : VirtualAxes(WireDevice::kTable, devices, clock) {}
  void connect() override;
  void enable() override;
  void clear_fault() override;

 private:
  void read_state() override;
  void order_move(const Positions& target) override;
  void order_stop() override;
  bool is_at_rest() const override { return is_reported_there_; }
  bool is_reported_there_ = false;
};

class VirtualLaser final : public Laser, private VirtualDevice {
 public:
  VirtualLaser(WiredDevices& devices, VirtualRobot& robot, VirtualClock& clock)
      : VirtualDevice(WireDevice::kLaser, devices, clock), robot_(robot) {}
  void connect() override;
  Limits limits() override;
  void enable() override;
  void disable() noexcept override;
  void prepare(double power_w, double pulse_s) override;
  void fire(double power_w, double pulse_s) override;
  bool off() noexcept override;
  Status status() override;
  void clear_fault() override;

 private:
  VirtualRobot& robot_;
  bool is_closed_ = true;
  double power_w_ = 0;
};

class VirtualCell {
 public:
  VirtualCell(const CellDescription& description, const WireOptions& options)
      : devices(description, options),
        clock(devices),
        robot(devices, clock),
        table(devices, clock),
        laser(devices, robot, clock) {
    devices.cell().set_sink([this](const Emission& emission) { emissions.push_back(emission); });
  }
  Cell cell() { return {robot, table, laser, clock}; }

  std::vector<Emission> emissions;
  WiredDevices devices;
  VirtualClock clock;
  VirtualRobot robot;
  VirtualTable table;
  VirtualLaser laser;
};

}  // namespace hilbrush::test
