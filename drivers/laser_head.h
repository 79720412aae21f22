#pragma once
#include <functional>
#include <string>
#include <vector>

#include "drivers/axis_group.h"
#include "drivers/laser.h"

namespace hilbrush {

/// The enabling half of a laser: its own link, by which emission is armed, power is set and states are read.
/// What opens the beam for one dot is its Gate.
class LaserHead {
 public:
  struct Status {
    DeviceState state = DeviceState::kDisconnected;  ///< kReady: armed
    bool interlock_closed = false;
    std::string fault;  ///< a sentence, if state is kFault
    double read_s = 0;  ///< when the reading it comes from was begun, on the cell's clock
  };
  struct Powers {
    double min_w = 0;
    double max_w = 0;
  };

  virtual ~LaserHead() = default;
  virtual void connect() = 0;  ///< disconnected -> connected; emission off, and confirmed
  virtual std::vector<std::string> identify() = 0;  ///< a line each, for the operator
  virtual Powers powers() = 0;  ///< the device's own limits, as read when it was connected
  /// Checks key, interlock and faults, sets the modulation, waits for the start delay. @throws DriverError
  virtual void arm() = 0;
  /// Emission off. From any thread, idempotent, bounded. True if the device confirms it.
  virtual bool disarm() noexcept = 0;
  /// Sent only when it changes, and read back. @throws DriverError if the device has another power
  /// afterwards.
  virtual void set_power(double power_w) = 0;
  /// By the last reading: cheap, from any thread.
  virtual Status status() = 0;
  /// Asks for a reading as soon as the link is free, and returns. From any thread.
  virtual void request_status() = 0;
  virtual void clear_fault() = 0;
  /// A pulse of another device's gate is about to begin, or is confirmed over: a head that outlives its user
  /// turns emission off if it hears of no end. begin_pulse() throws DriverError if the guard is lost;
  /// end_pulse() may be called from any thread.
  virtual void begin_pulse(double /*pulse_s*/) {}
  virtual void end_pulse() noexcept {}
  /// Called from any thread when status() has changed or a reading came that request_status() asked for. Set
  /// once.
  virtual void set_listener(std::function<void()> on_change) = 0;
};

}  // namespace hilbrush
